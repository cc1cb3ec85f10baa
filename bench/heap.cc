// heap.cc - counts what C++ code allocates, OpenSubdiv's library included, while asked to.
//
// A file of its own, so that no compiler sees through operator new. Not for several threads.

#include "bench.h"

#include <malloc.h>

#include <algorithm>
#include <cstdlib>
#include <new>

static bool counting;
static osd_memory counted;

void heap_count_start(void)
{
    counted = osd_memory();
    counting = true;
}

osd_memory heap_count(void) { return counted; }
void heap_count_stop(void) { counting = false; }

void *operator new(size_t size)
{
    void *memory = std::malloc(size ? size : 1);
    if (!memory) throw std::bad_alloc();
    if (counting) {
        counted.allocations++;
        counted.resident += malloc_usable_size(memory);
        counted.peak = std::max(counted.peak, counted.resident);
    }
    return memory;
}

void operator delete(void *memory) noexcept
{
    if (counting && memory) counted.resident -= malloc_usable_size(memory);
    std::free(memory);
}

void operator delete(void *memory, size_t) noexcept { operator delete(memory); }
