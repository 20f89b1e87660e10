/* For Python: what the node asks of its application, as a table of functions that the context points to. */
#include "firmware/can/node_state.h"

typedef struct {
    bool (*send)(void *context, const node_frame_t *frame);
    bool (*on)(void *context);
    int32_t (*get)(void *context, const od_entry_t *entry);
    uint32_t (*put)(void *context, const od_entry_t *entry, int32_t value);
    uint32_t (*size)(void *context, const od_entry_t *entry);
    void (*read)(void *context, const od_entry_t *entry, uint32_t offset, uint8_t bytes[], uint32_t count);
    uint32_t (*write)(void *context, const od_entry_t *entry, uint32_t offset, const uint8_t bytes[],
                      uint32_t count, bool last);
    uint32_t (*store)(void *context, uint32_t group);
    uint32_t (*restore)(void *context, uint32_t group);
    void (*recall)(void *context);
    void (*alarm)(void *context, uint16_t code);
    void (*reset)(void *context);
} host_table_t;

static const host_table_t *table(void *context)
{
    return context;
}

bool node_host_send(void *context, const node_frame_t *frame)
{
    return table(context)->send(context, frame);
}

bool node_host_on(void *context)
{
    return table(context)->on(context);
}

int32_t node_host_get(void *context, const od_entry_t *entry)
{
    return table(context)->get(context, entry);
}

uint32_t node_host_put(void *context, const od_entry_t *entry, int32_t value)
{
    return table(context)->put(context, entry, value);
}

uint32_t node_host_size(void *context, const od_entry_t *entry)
{
    return table(context)->size(context, entry);
}

void node_host_read(void *context, const od_entry_t *entry, uint32_t offset, uint8_t bytes[], uint32_t count)
{
    table(context)->read(context, entry, offset, bytes, count);
}

uint32_t node_host_write(void *context, const od_entry_t *entry, uint32_t offset, const uint8_t bytes[],
                         uint32_t count, bool last)
{
    return table(context)->write(context, entry, offset, bytes, count, last);
}

uint32_t node_host_store(void *context, uint32_t group)
{
    return table(context)->store(context, group);
}

uint32_t node_host_restore(void *context, uint32_t group)
{
    return table(context)->restore(context, group);
}

void node_host_recall(void *context)
{
    table(context)->recall(context);
}

void node_host_alarm(void *context, uint16_t code)
{
    table(context)->alarm(context, code);
}

void node_host_reset(void *context)
{
    table(context)->reset(context);
}
