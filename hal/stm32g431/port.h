/* Port for ST's B-G431B-ESC1 (STM32G431CB, 170 MHz): the state that the application allocates.
 *
 * Both halves of a carrier period are equal: compare[leg][0] serves both. New compare values take effect at
 * the centre of the zero vector, a change of the legs' states about 1 us later, in programs
 * with more channels up to 2.1 us. docs/board.md has wiring and
 * bench checks, README.md here the registers that are used. */
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

/* As wired and programmed today, beside three leg currents and the DC-link voltage; both halves of a period alike. A
 * second sample and commutation within the period are within TIM1 and the converters and not yet programmed. */
#define PORT_CHANNELS (PORT_AT_PB11 | NEEDS_HELD | NEEDS_ONE_SWITCH)

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
    bool slow;       /* the PLL has failed: the clock after reset, too slow for the bus */
    bool sound;      /* flash holds what was built */
    uint32_t legs;   /* of the coming period: CCER, or with PWM on one switch PM_LEGS_... */
    uint32_t bridge; /* BDTR with everything but the main output enable */
    bool refused;    /* the bridge cannot be armed */
    hal_reset_t reset;
    uint16_t code[PORT_TURNS]; /* last conversions of what is slow, 12 bits */
    uint8_t turn;              /* of them, the one that runs */
    port_can_t can;
    port_console_t console;
};

#endif
