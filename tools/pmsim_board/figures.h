/* What the processor did: instructions and cycles per control interrupt by mode, stack, load. One per
 * program: every rig adds its own when it is done; safe with several threads. */
#ifndef PMSIM_BOARD_FIGURES_H
#define PMSIM_BOARD_FIGURES_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Modes of the control interrupt: what the drive did in it. */
enum {
    FIGURE_OFF,
    FIGURE_CALIBRATE,
    FIGURE_PULSES,
    FIGURE_IDENTIFY,
    FIGURE_ALIGN,
    FIGURE_OPEN_LOOP,
    FIGURE_INJECTION,
    FIGURE_BLEND, /* injection and observer */
    FIGURE_FLUX,
    FIGURE_WEAKENING,
    FIGURE_SIX_STEP,
    FIGURE_MODES
};
/* What may happen in any of them, counted there and here */
enum {
    FIGURE_LIMITED, /* the voltage vector was shortened */
    FIGURE_FAULT,   /* a fault was found */
    FIGURE_SWAP,    /* the first period with a new set of parameters */
    FIGURE_EVENTS
};
/* Interrupts */
enum { FIGURE_CONTROL, FIGURE_MONITOR, FIGURE_SLOW, FIGURE_CAN, FIGURE_CONSOLE, FIGURE_INTERRUPTS };

typedef struct {
    uint64_t count, sum, least, most;
} figure_t;

typedef struct {
    figure_t instructions, cycles;    /* cycles: typical */
    uint64_t cycles_low, cycles_high; /* sums */
} interrupt_figure_t;

typedef struct {
    interrupt_figure_t mode[FIGURE_MODES]; /* of the control interrupt */
    interrupt_figure_t event[FIGURE_EVENTS];
    interrupt_figure_t interrupt[FIGURE_INTERRUPTS];
    uint64_t latency_most; /* of control, cycles */
    uint64_t identical; /* control and slow interrupts whose memory was that of the host's drive after them */
    uint64_t cycles, cycles_asleep;
    uint64_t clock_Hz;
    uint64_t period_cycles;
    uint32_t stack_most;
    uint32_t resets;
    uint64_t bus_frames, bus_idle; /* of --bus-load: frames, and looks that found the bus idle */
    uint32_t refused;              /* requests that the node did not do */
    double simulated_s;
} figures_t;

void figure_add(figure_t *figure, uint64_t value);
void figures_merge(const figures_t *figures); /* into the program's */

#ifdef __cplusplus
}
#endif

#endif
