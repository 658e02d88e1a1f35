/*
 * Makes one call to the operating system fail: loaded before the C library (LD_PRELOAD), it counts the calls that touch
 * files under a folder and lets one of them go wrong.
 *
 *   FAULT_UNDER   the folder; other files are left alone
 *   FAULT_AT      which call, from 1 on; 0 for none
 *   FAULT_KIND    full (ENOSPC), io (EIO), quota (EDQUOT), short (half of a write, then ENOSPC), lost (a rename that
 *                 says it is done and is not), kill (the process ends before the call)
 *   FAULT_COUNT   a file the number of calls is written to when the process ends
 *
 * Calls: open for writing, write, pwrite, writev, read, pread, fsync, ftruncate, copy_file_range, rename, mkdir, unlink.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

static const char *under;
static size_t under_length;
static const char *kind = "";
static long at;
static atomic_long calls;
/* The rest of a short write fails too. */
static atomic_int is_full;

__attribute__((constructor)) static void begin(void) {
    const char *number = getenv("FAULT_AT");
    under = getenv("FAULT_UNDER");
    under_length = under ? strlen(under) : 0;
    at = number ? atol(number) : 0;
    if (getenv("FAULT_KIND"))
        kind = getenv("FAULT_KIND");
}

__attribute__((destructor)) static void end(void) {
    const char *path = getenv("FAULT_COUNT");
    FILE *file;
    if (path && (file = fopen(path, "w"))) {
        fprintf(file, "%ld\n", (long)calls);
        fclose(file);
    }
}

static int is_kind(const char *name) { return strcmp(kind, name) == 0; }

static int counts(const char *path) {
    return under_length && path && strncmp(path, under, under_length) == 0;
}

static int counts_open(int descriptor) {
    char link[64], path[PATH_MAX];
    ssize_t length;
    int before = errno;
    if (!under_length)
        return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
    length = readlink(link, path, sizeof path - 1);
    errno = before;
    if (length < 0)
        return 0;
    path[length] = 0;
    return counts(path);
}

/* Whether this call is to go wrong; errno says how. */
static int fails(void) {
    if (atomic_fetch_add(&calls, 1) + 1 != at)
        return 0;
    if (is_kind("kill"))
        kill(getpid(), SIGKILL);
    errno = is_kind("full") || is_kind("short") ? ENOSPC : is_kind("quota") ? EDQUOT : EIO;
    return 1;
}

/* For calls that write: 1 to fail, 2 to write half. */
static int fails_writing(int descriptor, size_t count) {
    if (!counts_open(descriptor))
        return 0;
    if (is_full) {
        errno = ENOSPC;
        return 1;
    }
    if (!fails())
        return 0;
    if (is_kind("short") && count > 1) {
        is_full = 1;
        return 2;
    }
    return 1;
}

#define REAL(name) ((__typeof__(&name))real(#name))

static void *real(const char *name) { return dlsym(RTLD_NEXT, name); }

#define WRITE_FLAGS (O_WRONLY | O_RDWR | O_CREAT)

static mode_t mode_of(int flags, va_list *arguments) {
    return flags & (O_CREAT | O_TMPFILE) ? va_arg(*arguments, mode_t) : 0;
}

#define OPEN(name)                                                                                                     \
    int name(const char *path, int flags, ...) {                                                                       \
        va_list arguments;                                                                                             \
        mode_t mode;                                                                                                   \
        va_start(arguments, flags);                                                                                    \
        mode = mode_of(flags, &arguments);                                                                             \
        va_end(arguments);                                                                                             \
        if (flags & WRITE_FLAGS && counts(path) && fails())                                                            \
            return -1;                                                                                                 \
        return REAL(name)(path, flags, mode);                                                                          \
    }
OPEN(open)
OPEN(open64)

#define WRITE_AT(name, offset_type)                                                                                    \
    ssize_t name(int descriptor, const void *bytes, size_t count, offset_type offset) {                                \
        int how = fails_writing(descriptor, count);                                                                    \
        return how == 1 ? -1 : REAL(name)(descriptor, bytes, how ? count / 2 : count, offset);                         \
    }
WRITE_AT(pwrite, off_t)
WRITE_AT(pwrite64, off64_t)

ssize_t write(int descriptor, const void *bytes, size_t count) {
    int how = fails_writing(descriptor, count);
    return how == 1 ? -1 : REAL(write)(descriptor, bytes, how ? count / 2 : count);
}

ssize_t writev(int descriptor, const struct iovec *pieces, int count) {
    return fails_writing(descriptor, 0) ? -1 : REAL(writev)(descriptor, pieces, count);
}

ssize_t read(int descriptor, void *bytes, size_t count) {
    return counts_open(descriptor) && fails() ? -1 : REAL(read)(descriptor, bytes, count);
}

#define READ_AT(name, offset_type)                                                                                     \
    ssize_t name(int descriptor, void *bytes, size_t count, offset_type offset) {                                      \
        return counts_open(descriptor) && fails() ? -1 : REAL(name)(descriptor, bytes, count, offset);                 \
    }
READ_AT(pread, off_t)
READ_AT(pread64, off64_t)

int fsync(int descriptor) { return counts_open(descriptor) && fails() ? -1 : REAL(fsync)(descriptor); }

int ftruncate(int descriptor, off_t length) {
    return counts_open(descriptor) && fails() ? -1 : REAL(ftruncate)(descriptor, length);
}

int ftruncate64(int descriptor, off64_t length) {
    return counts_open(descriptor) && fails() ? -1 : REAL(ftruncate64)(descriptor, length);
}

ssize_t copy_file_range(int from, off64_t *from_at, int to, off64_t *to_at, size_t count, unsigned flags) {
    return counts_open(to) && fails() ? -1 : REAL(copy_file_range)(from, from_at, to, to_at, count, flags);
}

int rename(const char *from, const char *to) {
    if (counts(to) && fails())
        return is_kind("lost") ? 0 : -1;
    return REAL(rename)(from, to);
}

int mkdir(const char *path, mode_t mode) { return counts(path) && fails() ? -1 : REAL(mkdir)(path, mode); }

int unlink(const char *path) { return counts(path) && fails() ? -1 : REAL(unlink)(path); }

int unlinkat(int folder, const char *path, int flags) {
    int is_ours = path[0] == '/' ? counts(path) : counts_open(folder);
    return is_ours && fails() ? -1 : REAL(unlinkat)(folder, path, flags);
}
