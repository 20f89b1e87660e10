#include "sim_plant/board/alarms.h"

#include <stddef.h>
#include <string.h>

void alarms_clear(alarms_t *alarms)
{
    memset(alarms, 0, sizeof *alarms);
    alarms->next = UINT64_MAX;
    alarms->serving = UINT64_MAX;
}

static void update(alarms_t *alarms)
{
    alarms->next = alarms->count == 0 ? UINT64_MAX : alarms->entry[alarms->count - 1].cycle;
}

static void take_out(alarms_t *alarms, unsigned index)
{
    alarms->count--;
    memmove(&alarms->entry[index], &alarms->entry[index + 1],
            (alarms->count - index) * sizeof alarms->entry[0]);
}

static bool later(const alarm_entry_t *a, const alarm_entry_t *b)
{
    return a->cycle != b->cycle ? a->cycle > b->cycle : a->order > b->order;
}

bool alarms_set(alarms_t *alarms, void *owner, uint64_t cycle, alarms_call_t call)
{
    for (unsigned i = 0; i < alarms->count; i++) {
        if (alarms->entry[i].owner == owner) {
            take_out(alarms, i);
            break;
        }
    }
    if (cycle != UINT64_MAX) {
        if (alarms->count == ALARMS_MOST) {
            return false;
        }
        const alarm_entry_t entry = {cycle, alarms->order++, owner, call};
        unsigned place = alarms->count;
        while (place > 0 && later(&entry, &alarms->entry[place - 1])) {
            alarms->entry[place] = alarms->entry[place - 1];
            place--;
        }
        alarms->entry[place] = entry;
        alarms->count++;
    }
    update(alarms);
    return true;
}

bool alarms_serve(alarms_t *alarms, uint64_t now)
{
    if (alarms->next > now) {
        return false;
    }
    alarms->count--;
    const alarm_entry_t due = alarms->entry[alarms->count];
    update(alarms);
    alarms->serving = due.cycle;
    due.call(due.owner, due.cycle);
    alarms->serving = UINT64_MAX;
    return true;
}
