/* The implementation alone, from a header that is seen several times in any order. */
#include "patchsurf.h"
#define PSURF_IMPLEMENTATION
#include "patchsurf.h"
#include "patchsurf.h"
