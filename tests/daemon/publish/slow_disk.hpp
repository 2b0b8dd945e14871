// A disk that hangs: until it is released, fsync and fdatasync of this program wait.
#pragma once

namespace shaker::daemon::testing {

void hang_the_disk(bool hang);

}  // namespace shaker::daemon::testing
