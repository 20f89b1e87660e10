/* Port `sim`: the hardware is the plant. Any number of instances; nothing runs by itself: sim_loop.h calls.
 *
 * Converter codes go from plant to application and timer counts back unchanged, so the code under test is
 * that of the target. The over-current comparators are the plant's (plant_set_break()): they switch the
 * bridge off at their instant, and the next measurement reports it. The user of the plant sets the
 * temperature; flash is memory; frames go through two queues. Cells that were written or erased when power was
 * lost have no certain contents: they read as random data, and after sim_store_settle() perhaps as others. */
#ifndef HAL_SIM_PORT_H
#define HAL_SIM_PORT_H

#include "hal/hal.h"
#include "sim_plant/plant.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SIM_FRAMES  32 /* 1 Mbit/s brings at most 21 in a millisecond */
#define SIM_CONSOLE 4096

typedef struct {
    hal_can_frame_t frame[SIM_FRAMES];
    uint32_t first, count;
} sim_queue_t;

/* Cells of a page whose writing or erasing was cut */
typedef struct {
    uint32_t from, bytes; /* 0 bytes: none */
    uint8_t was[HAL_STORE_PAGE_SIZE], wanted[HAL_STORE_PAGE_SIZE];
} sim_cut_t;

struct hal {
    plant_t *plant;
    app_t *app;      /* since hal_start() */
    plant_adc_t adc; /* of the present period */
    uint32_t time_us, timer_Hz;
    hal_board_t board;
    bool armed, configured;
    bool broke;                        /* a break that is not reported yet */
    uint16_t timer_counts;             /* of half a period */
    uint16_t sample_at[2][PM_SAMPLES]; /* asked for: for this period, for the next */
    uint16_t commutate_at[2], then[2]; /* the same */
    plant_adc_t sample[PM_SAMPLES];    /* taken in the last period ... */
    uint16_t sampled;                  /* ... bit n: so it was */
    uint32_t without;                  /* channels that are taken from what the plant has: NEEDS_... */
    bool slow_pending;

    /* for the user of the loop */
    int32_t temperature_dC; /* what the sensor says */
    bool hw_fault;          /* held break input */
    bool temperature_missing;
    bool reference_off;
    sim_queue_t received, sent; /* seen from the application */
    hal_can_state_t can_state;
    uint32_t can_lost, watchdog_fed;
    uint32_t store[HAL_STORE_PAGES][HAL_STORE_PAGE_SIZE / sizeof(uint32_t)];
    uint32_t store_bytes_left; /* flash loses power after so many bytes; UINT32_MAX: never */
    sim_cut_t store_cut[HAL_STORE_PAGES];
    void (*while_storing)(app_t *app); /* called for each double word, in place of interrupts; NULL: none */
    char console[SIM_CONSOLE];
    bool led, reset;
};

/* The plant's period, with the samples that were asked for. Once a period after app_control(). */
void sim_run_period(hal_t *hal);

/* The legs change now, at the plant's present instant, until the next period. */
void sim_commutate(hal_t *hal, uint16_t legs);

/* Power comes back, whose loss cut cells: they read as what they were, as what they were to be, or each bit as
 * one or the other; another time otherwise. */
void sim_store_settle(hal_t *hal, uint32_t seed);

/* A break of an instant, by the break input. */
void sim_break(hal_t *hal);

/* Erased store, no faults; the timer's clock of the drive board. */
void sim_hal_init(hal_t *hal, plant_t *plant);

bool sim_queue_put(sim_queue_t *queue, const hal_can_frame_t *frame); /* false: full */
bool sim_queue_take(sim_queue_t *queue, hal_can_frame_t *frame);

#ifdef __cplusplus
}
#endif

#endif
