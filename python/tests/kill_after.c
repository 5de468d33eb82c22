/* Loaded before a program: looks at a file as a reader, or a program after a kill, would find it.
   Before each call that changes a file, the watched files are copied to FOLDER/<call>-<number>.
   WATCH_FOLDER = FOLDER, WATCH_FILES = names separated by colons. With KILL_AFTER = n instead the
   program is killed, as SIGKILL does, before its n-th such call. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <unistd.h>

static long count;

static void copy(const char *from, const char *to)
{
    static char data[1 << 16];
    int in = open(from, O_RDONLY), out;
    long n;
    if (in < 0) return;
    out = open(to, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    while ((n = syscall(SYS_read, in, data, sizeof data)) > 0)
        if (syscall(SYS_write, out, data, n) != n) abort();
    close(in);
    close(out);
}

static void look(void)
{
    const char *kill_after = getenv("KILL_AFTER");
    const char *folder = getenv("WATCH_FOLDER");
    const char *files = getenv("WATCH_FILES");
    char names[4096], place[4096], *name, *rest;
    int number = 0;

    if (kill_after && count == atol(kill_after)) kill(getpid(), SIGKILL);
    if (folder && files) {
        snprintf(names, sizeof names, "%s", files);
        for (name = strtok_r(names, ":", &rest); name; name = strtok_r(NULL, ":", &rest)) {
            snprintf(place, sizeof place, "%s/%06ld-%d", folder, count, number++);
            copy(name, place);
        }
    }
    count++;
}

#define NEXT(result, name, parameters, arguments)                                   \
    result name parameters                                                          \
    {                                                                               \
        static result(*next) parameters;                                            \
        if (!next) *(void **)&next = dlsym(RTLD_NEXT, #name);                       \
        look();                                                                     \
        return next arguments;                                                      \
    }

NEXT(ssize_t, write, (int fd, const void *data, size_t size), (fd, data, size))
NEXT(ssize_t, pwrite, (int fd, const void *data, size_t size, off_t at), (fd, data, size, at))
NEXT(ssize_t, pwrite64, (int fd, const void *data, size_t size, off64_t at), (fd, data, size, at))
NEXT(int, truncate, (const char *path, off_t size), (path, size))
NEXT(int, ftruncate, (int fd, off_t size), (fd, size))
NEXT(int, ftruncate64, (int fd, off64_t size), (fd, size))
NEXT(int, rename, (const char *old, const char *new), (old, new))
NEXT(int, unlink, (const char *path), (path))
