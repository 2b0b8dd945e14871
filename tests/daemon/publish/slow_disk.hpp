// A disk that does not come back: as long as it hangs, fsync and fdatasync of this program wait.
#pragma once

namespace shaker::daemon::testing {

void hang_the_disk(bool hang);

}  // namespace shaker::daemon::testing
