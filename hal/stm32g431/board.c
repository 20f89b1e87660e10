/* The schematic of the B-G431B-ESC1 (docs/board.md). No register is touched here: the host has it too. */
#include "hal/hal.h"

static const hal_board_t board = {
    .shunt_uohm = 3000,        /* below each lower switch */
    .current_gain = 9143,      /* 16 of the amplifier, 4/7 of the network in front of it */
    .voltage_divider = 10389,  /* 169 and 18 kohm */
    .i_full_scale_mA = 60156,  /* 1.65 V over both */
    .v_full_scale_mV = 34283,  /* 3.3 V */
    .i_limit_mA = 40000,       /* what the maker has tested it with */
    .v_limit_mV = 32000,       /* 25.2 V of six cells, and room for braking; transistors for 60 V */
    .i_bridge_mA = 25000,      /* without a stream of air: chosen, 7 W in switches and shunts */
    .t_bridge_ms = 10000,      /* of a board of 30 by 41 mm: chosen */
    .dead_time_least_ns = 300, /* the driver's delays differ by up to 50 ns, the transistors take 100 */
    .f_pwm_least_Hz = 4000,
    /* the interrupts of control and 1 kHz, and with a neutral that of its further sample, end within a period */
    .f_pwm_most_Hz = PM_CARRIES(NEEDS_NEUTRAL) ? 30000 : 40000,
};

const hal_board_t *hal_board(const hal_t *hal)
{
    (void)hal;
    return &board;
}
