#include "tools/pmsim_board/bus_load.h"

#include <string.h>

#include "firmware/app/app.h"
#include "firmware/params/store.h"

/* 100 us at 1 Mbit/s bring two of the shortest frames; commands wait behind these as well. */
#define WAITING     4U
#define BIT_RATE_ID 0x208002U

bus_load_t bus_load(bus_noise_kind_t kind)
{
    return (bus_load_t){.noise = {.kind = kind, .state = 1U}};
}

void bus_load_fill(bus_load_t *load, board_t *board)
{
    if (load->noise.kind == BUS_QUIET) {
        return;
    }
    uint32_t waiting = board_can_waiting(board);
    load->idle += load->begun && waiting == 0U ? 1U : 0U;
    for (; waiting < WAITING; waiting++) {
        const hal_can_frame_t frame = bus_noise_next(&load->noise);
        board_frame_t put = {.id = frame.id, .length = frame.length};
        memcpy(put.data, frame.data, sizeof put.data);
        if (!board_can_send(board, &put)) {
            return; /* the image is not on the bus yet */
        }
        load->begun = true;
        load->frames++;
    }
}

uint32_t bus_load_page(const drive_params_t *params, uint32_t kbit_s, uint32_t words[])
{
    uint32_t page[STORE_WORDS];
    store_writer_t writer;
    (void)app_page(params, 1, page);
    const uint32_t count = (uint32_t)store_check(page);
    uint32_t at = STORE_HEADER;
    store_begin(&writer, 1, od_schema, count + 1U, words);
    for (uint32_t n = 0; n < count; n++) {
        store_put(&writer, store_pair(page, n), &words[at]);
        at += 2U;
    }
    store_put(&writer, (store_pair_t){.id = BIT_RATE_ID, .value = (int32_t)kbit_s}, &words[at]);
    store_end(&writer, &words[at + 2U]);
    store_seal(&words[at + 4U]);
    return at + 6U;
}
