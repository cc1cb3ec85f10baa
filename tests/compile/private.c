/* A copy of its own inside one translation unit, of which one function is used. Linked with
   another unit that has the public implementation, there is no clash. */
#define PSURF_STATIC
#define PSURF_IMPLEMENTATION
#include "patchsurf.h"

uint32_t user_version(void);
uint32_t user_version(void)
{
    return psurf_version();
}
