/* Runs a fuzz target over files, without libFuzzer: to replay a corpus or a crash under any
   compiler, valgrind or an emulator. Directories are read one level deep.

       gcc -g -I. -fsanitize=address,undefined fuzz/fuzz_topology.c fuzz/standalone.c -lm -o replay
       ./replay fuzz/corpus/topology                                                              */

#define _POSIX_C_SOURCE 200809L

#include <dirent.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void run_file(const char *path)
{
    static uint8_t buffer[1 << 20];
    FILE *file = fopen(path, "rb");
    if (!file) {
        perror(path);
        exit(2);
    }
    size_t size = fread(buffer, 1, sizeof buffer, file);
    fclose(file);
    /* A copy of its own size lets the sanitizer see reads past the end. */
    uint8_t *data = (uint8_t *)malloc(size + !size);
    if (!data)
        exit(2);
    for (size_t i = 0; i < size; i++)
        data[i] = buffer[i];
    printf("%s\n", path);               /* so that the last line names the input that crashed */
    fflush(stdout);
    LLVMFuzzerTestOneInput(data, size);
    free(data);
}

static unsigned run_path(const char *path)
{
    DIR *directory = opendir(path);
    if (!directory) {
        run_file(path);
        return 1;
    }
    unsigned count = 0;
    for (const struct dirent *entry = readdir(directory); entry; entry = readdir(directory)) {
        char name[4096];
        if (entry->d_name[0] == '.')
            continue;
        snprintf(name, sizeof name, "%s/%s", path, entry->d_name);
        run_file(name);
        count++;
    }
    closedir(directory);
    return count;
}

int main(int argc, char **argv)
{
    unsigned count = 0;
    for (int i = 1; i < argc; i++)
        count += run_path(argv[i]);
    printf("%u inputs, no failure\n", count);
    return count ? 0 : 2;
}
