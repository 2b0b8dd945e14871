#include "daemon/publish/lease.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;

TEST(Lease, BelongsToOneClientUntilItRunsOut) {
  Lease lease(2s);
  EXPECT_TRUE(lease.acquire(1, 0s));
  EXPECT_FALSE(lease.acquire(2, 1s));
  EXPECT_EQ(lease.expire(1999ms), std::nullopt);
  EXPECT_EQ(lease.expire(2s), 1);
  EXPECT_EQ(lease.expire(3s), std::nullopt);  // reported only once
  EXPECT_TRUE(lease.acquire(2, 3s));
}

TEST(Lease, IsRenewedByItsHolderOnly) {
  Lease lease(2s);
  ASSERT_TRUE(lease.acquire(1, 0s));
  lease.renew(2, 1s);
  EXPECT_EQ(lease.expire(2s), 1);
  ASSERT_TRUE(lease.acquire(1, 2s));
  lease.renew(1, 3s);
  EXPECT_EQ(lease.expire(4s), std::nullopt);
}

TEST(Lease, IsReleasedByItsHolderOnly) {
  Lease lease(2s);
  ASSERT_TRUE(lease.acquire(1, 0s));
  EXPECT_FALSE(lease.release(2));
  EXPECT_TRUE(lease.release(1));
  EXPECT_FALSE(lease.held_by(1));
}

}  // namespace
}  // namespace shaker::daemon
