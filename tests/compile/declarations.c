/* A user of an implementation that lives in another translation unit, implementation.c. */
#include "patchsurf.h"
#include "patchsurf.h"

int main(void)
{
    return psurf_version() != PSURF_VERSION || psurf_abi() >> 8 != PSURF_VERSION ||
           !psurf_result_string(PSURF_OK);
}
