/* threads.c - patchsurf's passes and tessellation on ranges, by several threads. */

#if !defined(_POSIX_C_SOURCE)
#define _POSIX_C_SOURCE 200809L         /* sched_yield */
#endif

#include "threads.h"

#include <pthread.h>
#include <sched.h>
#include <stdlib.h>

/* Passes last a millisecond: who waits stays awake, as the workers of an engine do. */
typedef struct barrier { uint32_t size, waiting, generation; } barrier;

static void wait_for_all(barrier *b)
{
    const uint32_t generation = __atomic_load_n(&b->generation, __ATOMIC_ACQUIRE);
    if (__atomic_add_fetch(&b->waiting, 1, __ATOMIC_ACQ_REL) == b->size) {
        __atomic_store_n(&b->waiting, 0, __ATOMIC_RELAXED);
        __atomic_store_n(&b->generation, generation + 1, __ATOMIC_RELEASE);
        return;
    }
    while (__atomic_load_n(&b->generation, __ATOMIC_ACQUIRE) == generation) sched_yield();
}

typedef struct team {
    const tessellation *t;
    float *out;
    uint32_t size;
    barrier gate;
    frame_times *times;
    int frames;
} team;

typedef struct member { team *all; uint32_t number; } member;

/* Where share number of parts shares starts. */
static uint32_t share(uint32_t items, uint32_t number, uint32_t parts)
{
    return (uint32_t)((uint64_t)items * number / parts);
}

/* Items stand in the order of kinds, which differ in cost: several ranges each, in turn. */
static void work_on_pass(const member *me, psurf_pass pass)
{
    const surface *s = me->all->t->s;
    const uint32_t items = s->patches.layout.pass_items[pass], size = me->all->size;
    const uint32_t ranges = 8 * size;
    uint32_t i;
    for (i = me->number; i < ranges; i += size) {
        const uint32_t first = share(items, i, ranges);
        if (psurf_construct_pass(&s->patches, &s->construct, pass, first,
                                 share(items, i + 1, ranges) - first))
            fail("construction failed");
    }
    wait_for_all(&me->all->gate);
}

static void work_on_points(const member *me)
{
    const tessellation *t = me->all->t;
    const uint32_t first = share(t->faces, me->number, me->all->size);
    const uint32_t next = share(t->faces, me->number + 1, me->all->size);
    psurf_tess_span before;
    if (psurf_tessellate_size(t->s->topology, &t->desc, 0, first, &before))
        fail("a tessellation was refused");
    tessellate(t, first, next - first, me->all->out + 6 * (size_t)before.vertex_count);
    wait_for_all(&me->all->gate);
}

static void *work(void *what)
{
    const member *me = (const member *)what;
    int i;
    for (i = 0; i < me->all->frames; i++) {
        double start, constructed;
        wait_for_all(&me->all->gate);
        start = now();
        work_on_pass(me, PSURF_PASS_CENTRES);
        work_on_pass(me, PSURF_PASS_VERTICES);
        work_on_pass(me, PSURF_PASS_FACETS);
        constructed = now();
        work_on_points(me);
        if (me->number == 0) {
            me->all->times[i].construct = constructed - start;
            me->all->times[i].tessellate = now() - constructed;
        }
    }
    return NULL;
}

void run_team(const tessellation *t, uint32_t size, float *out, frame_times *times, int frames)
{
    pthread_t threads[MAX_TEAM];
    member members[MAX_TEAM];
    team all;
    uint32_t i;
    all.t = t;
    all.out = out;
    all.size = size;
    all.times = times;
    all.frames = frames;
    all.gate.size = size;
    all.gate.waiting = all.gate.generation = 0;
    for (i = 0; i < size; i++) {
        members[i].all = &all;
        members[i].number = i;
        if (i && pthread_create(&threads[i], NULL, work, &members[i])) fail("no thread");
    }
    work(&members[0]);
    for (i = 1; i < size; i++) pthread_join(threads[i], NULL);
}
