// Makes the disk of one folder, the wall clock, or the memory of one thread fail on command (LD_PRELOAD).
//
// NEMESIS_ORDER names a file that the test maps too: `struct order`. NEMESIS_FOLDER is the folder whose files are meant; calls on other files are never
// touched.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/statvfs.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

enum { NOTHING, FLUSH_HANGS, MOUNT_HANGS, FLUSH_FAILS, WRITE_FAILS, CALL_FAILS };

struct order {
  volatile int32_t mode;
  volatile int32_t code;    // errno of a call that fails
  volatile int32_t left;    // so many calls fail yet; -1: all. CALL_FAILS: calls until one fails
  volatile int32_t hits;    // calls that were touched
  volatile double clock_s;  // by which the wall clock is off
  volatile int32_t starved;  // the thread whose allocations are counted; 0: none
  volatile int32_t nth;      // allocations until one fails
  volatile int32_t for_good; // all allocations or calls that follow fail too
};

static struct order none;
static struct order* order = &none;
static char folder[4096];

__attribute__((constructor)) static void begin(void) {
  const char* file = getenv("NEMESIS_ORDER");
  const char* where = getenv("NEMESIS_FOLDER");
  if (!file || !where) return;
  snprintf(folder, sizeof folder, "%s", where);
  const int fd = open(file, O_RDWR | O_CLOEXEC);
  if (fd < 0) return;
  void* shared = mmap(NULL, sizeof *order, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  close(fd);
  if (shared != MAP_FAILED) order = shared;
}

static int below(const char* path) {
  return folder[0] && strncmp(path, folder, strlen(folder)) == 0;
}
static int ours(int fd) {
  char link[64], path[4096];
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t length = readlink(link, path, sizeof path - 1);
  if (length < 0) return 0;
  path[length] = 0;
  return below(path);
}
static void hang(void) {
  const int mode = order->mode;
  __sync_fetch_and_add(&order->hits, 1);
  while (order->mode == mode)
    usleep(5000);
}
// 1: the call fails with errno set.
static int fails(void) {
  if (order->left == 0) return 0;
  if (order->left > 0) __sync_fetch_and_sub(&order->left, 1);
  __sync_fetch_and_add(&order->hits, 1);
  errno = order->code;
  return 1;
}
// Each call on the folder's files counts.
static int nth_fails(void) {
  const int left = __sync_sub_and_fetch(&order->left, 1);
  if (left > 0 || (left < 0 && !order->for_good)) return 0;
  __sync_fetch_and_add(&order->hits, 1);
  errno = order->code;
  return 1;
}
static int touch_flush(int fd) {
  if (order->mode == NOTHING || !ours(fd)) return 0;
  if (order->mode == CALL_FAILS) return nth_fails();
  if (order->mode == FLUSH_HANGS || order->mode == MOUNT_HANGS) hang();
  return order->mode == FLUSH_FAILS && fails();
}
static int touch_write(int fd) {
  if (order->mode == NOTHING || !ours(fd)) return 0;
  if (order->mode == CALL_FAILS) return nth_fails();
  if (order->mode == MOUNT_HANGS) hang();
  return order->mode == WRITE_FAILS && fails();
}
static int touch_read(int fd) {
  return order->mode == CALL_FAILS && ours(fd) && nth_fails();
}
static int touch_path(const char* path) {
  if (order->mode == NOTHING || !path || !below(path)) return 0;
  if (order->mode == MOUNT_HANGS) hang();
  return order->mode == CALL_FAILS && nth_fails();
}

#define NEXT(name)               \
  static __typeof__(&name) next; \
  if (!next) next = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

int fsync(int fd) {
  NEXT(fsync);
  return touch_flush(fd) ? -1 : next(fd);
}
int fdatasync(int fd) {
  NEXT(fdatasync);
  return touch_flush(fd) ? -1 : next(fd);
}
ssize_t write(int fd, const void* data, size_t size) {
  NEXT(write);
  return touch_write(fd) ? -1 : next(fd, data, size);
}
ssize_t pwrite(int fd, const void* data, size_t size, off_t at) {
  NEXT(pwrite);
  return touch_write(fd) ? -1 : next(fd, data, size, at);
}
ssize_t pwrite64(int fd, const void* data, size_t size, off64_t at) {
  NEXT(pwrite64);
  return touch_write(fd) ? -1 : next(fd, data, size, at);
}
ssize_t read(int fd, void* data, size_t size) {
  NEXT(read);
  return touch_read(fd) ? -1 : next(fd, data, size);
}
ssize_t pread(int fd, void* data, size_t size, off_t at) {
  NEXT(pread);
  return touch_read(fd) ? -1 : next(fd, data, size, at);
}
ssize_t pread64(int fd, void* data, size_t size, off64_t at) {
  NEXT(pread64);
  return touch_read(fd) ? -1 : next(fd, data, size, at);
}
void* mmap(void* where, size_t size, int protection, int flags, int fd, off_t at) {
  NEXT(mmap);
  return fd >= 0 && touch_read(fd) ? MAP_FAILED : next(where, size, protection, flags, fd, at);
}
void* mmap64(void* where, size_t size, int protection, int flags, int fd, off64_t at) {
  NEXT(mmap64);
  return fd >= 0 && touch_read(fd) ? MAP_FAILED : next(where, size, protection, flags, fd, at);
}
int unlink(const char* path) {
  NEXT(unlink);
  return touch_path(path) ? -1 : next(path);
}
int rename(const char* from, const char* to) {
  NEXT(rename);
  return touch_path(to) ? -1 : next(from, to);
}
int ftruncate(int fd, off_t size) {
  NEXT(ftruncate);
  return touch_write(fd) ? -1 : next(fd, size);
}
int ftruncate64(int fd, off64_t size) {
  NEXT(ftruncate64);
  return touch_write(fd) ? -1 : next(fd, size);
}
int statvfs(const char* path, struct statvfs* out) {
  NEXT(statvfs);
  return touch_path(path) ? -1 : next(path, out);
}
int statvfs64(const char* path, struct statvfs64* out) {
  NEXT(statvfs64);
  return touch_path(path) ? -1 : next(path, out);
}
int open(const char* path, int flags, ...) {
  NEXT(open);
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = va_arg(rest, mode_t);
  va_end(rest);
  return touch_path(path) ? -1 : next(path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  NEXT(open64);
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = va_arg(rest, mode_t);
  va_end(rest);
  return touch_path(path) ? -1 : next(path, flags, mode);
}

// operator new calls malloc.
static __thread int32_t own_tid __attribute__((tls_model("initial-exec")));
static int starves(void) {
  if (order->starved == 0) return 0;
  if (own_tid == 0) own_tid = (int32_t)syscall(SYS_gettid);
  if (order->starved != own_tid || --order->nth > 0) return 0;
  if (!order->for_good) order->starved = 0;
  __sync_fetch_and_add(&order->hits, 1);
  errno = ENOMEM;
  return 1;
}
void* __libc_malloc(size_t size);
void* __libc_realloc(void* memory, size_t size);
void* malloc(size_t size) {
  return starves() ? NULL : __libc_malloc(size);
}
void* realloc(void* memory, size_t size) {
  return starves() ? NULL : __libc_realloc(memory, size);
}

int clock_gettime(clockid_t which, struct timespec* out) {
  NEXT(clock_gettime);
  const int result = next(which, out);
  const double off = order->clock_s;
  if (result == 0 && which == CLOCK_REALTIME && off != 0.0) out->tv_sec += (time_t)off;
  return result;
}
