/* Linked into every program of the build that tools/mutate makes.
 * PM_MUTANT_ALIVE=n: mutant n is alive. PM_MUTANT_REACHED=file: none is, and byte n of the file becomes 1 when the
 * place of mutant n is reached. A mapped file, so that children and programs that abort record as well. */
#include "chosen.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

int pm_mutant_alive = -2;
static unsigned char *reached;
static off_t count;

int pm_mutant_reach(int number)
{
    if (reached != NULL && number < count) {
        reached[number] = 1;
    }
    return 0;
}

static void __attribute__((constructor)) choose(void)
{
    const char *alive = getenv("PM_MUTANT_ALIVE");
    const char *path = getenv("PM_MUTANT_REACHED");
    /* without either, a number that no mutant has */
    pm_mutant_alive = alive != NULL ? atoi(alive) : 0x7fffffff;
    if (path == NULL) {
        return;
    }
    const int file = open(path, O_RDWR);
    struct stat about;
    if (file >= 0 && fstat(file, &about) == 0 && about.st_size > 0) {
        void *bytes = mmap(NULL, (size_t)about.st_size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
        if (bytes != MAP_FAILED) {
            reached = (unsigned char *)bytes;
            count = about.st_size;
            pm_mutant_alive = -1;
        }
    }
    if (file >= 0) {
        close(file);
    }
}
