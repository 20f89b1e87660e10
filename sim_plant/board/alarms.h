/* Things that are to happen at a cycle: one entry per owner, the earliest first. */
#ifndef BOARD_ALARMS_H
#define BOARD_ALARMS_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef void (*alarms_call_t)(void *owner, uint64_t cycle);

enum { ALARMS_MOST = 64 };

typedef struct {
    uint64_t cycle;
    uint64_t order; /* of setting: equal cycles are served first come, first served */
    void *owner;
    alarms_call_t call;
} alarm_entry_t;

typedef struct {
    alarm_entry_t entry[ALARMS_MOST]; /* the last one is the earliest */
    unsigned count;
    uint64_t next;    /* cycle of the earliest; UINT64_MAX: none */
    uint64_t serving; /* of the one whose call runs, which comes late by a block of instructions; else
                         UINT64_MAX */
    uint64_t order;
} alarms_t;

void alarms_clear(alarms_t *alarms);

/* Replaces what the owner has asked for before; UINT64_MAX cancels. False: too many owners. */
bool alarms_set(alarms_t *alarms, void *owner, uint64_t cycle, alarms_call_t call);

/* Takes the earliest out and calls it if its cycle has come. False: none due. */
bool alarms_serve(alarms_t *alarms, uint64_t now);

#ifdef __cplusplus
}
#endif

#endif
