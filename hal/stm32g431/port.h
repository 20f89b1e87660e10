/* Port for ST's B-G431B-ESC1 (STM32G431CB, 170 MHz): the state that the application allocates.
 *
 * Both halves of a carrier period are equal: compare[leg][0] serves both. New compare values take effect at
 * the centre of the zero vector, a change of the legs' states about 1 us later, in programs with more channels up to 2.1 us.
 * A further sample is taken at instants from 4.2 us after the update event to 1.8 us before the next; its terminals are held
 * within 0.4 us of the instant, the currents 1 us earlier.
 * docs/board.md has wiring and bench checks, README.md here the registers that are used. */
#ifndef STM32G431_PORT_H
#define STM32G431_PORT_H

#include "hal/hal.h"

/* PB11 has phase W's divider, or an amplifier of the user's in its place (docs/board.md): a program carries the terminals or
 * the neutral. */
#if PM_CARRIES(NEEDS_TERMINALS) && !PM_CARRIES(NEEDS_NEUTRAL)
#define PORT_AT_PB11 NEEDS_TERMINALS
#else
#define PORT_AT_PB11 NEEDS_NEUTRAL
#endif

/* As wired and programmed today, beside three leg currents and the DC-link voltage; both halves of a period alike. */
#define PORT_CHANNELS (PORT_AT_PB11 | NEEDS_SECOND_SAMPLE | NEEDS_HELD | NEEDS_ONE_SWITCH | NEEDS_COMMUTATE)

/* States of legs are written ahead and change by COM events. */
#define PORT_BY_COM PM_CARRIES(NEEDS_ONE_SWITCH | NEEDS_COMMUTATE)

#define PORT_CONSOLE_SIZE 128U /* powers of two */
#define PORT_CAN_FRAMES   16U

/* Written by one context and read by another; the counts run freely. */
typedef struct {
    char text[PORT_CONSOLE_SIZE];
    volatile uint32_t put, taken;
} port_console_t;

typedef struct {
    hal_can_frame_t frame[PORT_CAN_FRAMES];
    volatile uint32_t put, taken;
    volatile uint32_t lost;
} port_can_t;

enum { PORT_TEMPERATURE, PORT_DIAL, PORT_REFERENCE, PORT_TURNS };

struct hal {
    app_t *app;
    bool up, crystal;
    bool slow;     /* the PLL has failed: the clock after reset, too slow for the bus */
    bool sound;    /* flash holds what was built */
    uint32_t legs; /* of the coming period: CCER, or with PORT_BY_COM PM_LEGS_... */
#if PORT_BY_COM
    uint32_t written; /* PM_LEGS_... of the next COM event */
#endif
#if PM_CARRIES(NEEDS_COMMUTATE)
    uint32_t then; /* PM_LEGS_... from the instant of the coming period on, or legs */
#endif
#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
    uint32_t instants;  /* at which a sample is taken, from the first on */
    pm_measure_t *more; /* where its codes go: what is measured at the end of the period */
    uint16_t taken;     /* it is there */
#endif
    uint32_t bridge; /* BDTR with everything but the main output enable */
    bool refused;    /* the bridge cannot be armed */
    hal_reset_t reset;
    uint16_t code[PORT_TURNS]; /* last conversions of what is slow, 12 bits */
    uint8_t turn;              /* of them, the one that runs */
    port_can_t can;
    port_console_t console;
};

#endif
