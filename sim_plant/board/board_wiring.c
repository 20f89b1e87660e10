#include "sim_plant/board/board_wiring.h"

#include "sim_plant/board/board_chip.h"

#include <math.h>
#include <string.h>

double board_within_s(const board_chip_t *chip, uint64_t cycle)
{
    double plant_s = 1.0 / plant_inverter(chip->plant)->f_pwm_Hz;
    double cycles = cycle > chip->wiring.start ? (double)(cycle - chip->wiring.start) : 0.0;
    double whole = chip->wiring.in_step ? (double)tim1_period(&chip->tim1) : plant_s * chip->rcc.clock_Hz;
    return fmin(cycles / whole, 1.0) * plant_s;
}

void board_told(board_chip_t *chip)
{
    double after_s = 0.0;
    if (plant_broke(chip->plant, &after_s)) {
        memset(chip->wiring.driven, 0, sizeof chip->wiring.driven);
        tim1_break(&chip->tim1);
    }
}

void board_catch_up(board_chip_t *chip, uint64_t cycle)
{
    adc_sample_until(&chip->adc, cycle);
    plant_move(chip->plant, board_within_s(chip, cycle));
    board_told(chip);
}

void board_drive(board_chip_t *chip, const bool driven[BOARD_LEGS], const plant_leg_state_t state[BOARD_LEGS])
{
    board_wiring_t *wiring = &chip->wiring;
    if (memcmp(wiring->driven, driven, BOARD_LEGS * sizeof *driven) == 0 &&
        memcmp(wiring->state, state, BOARD_LEGS * sizeof *state) == 0) {
        return;
    }
    bool any = false;
    for (int leg = 0; leg < BOARD_LEGS; leg++) {
        wiring->driven[leg] = driven[leg];
        wiring->state[leg] = state[leg];
        any = any || driven[leg];
    }
    adc_sample_until(&chip->adc, cpu_now(chip->cpu));
    plant_move(chip->plant, board_within_s(chip, cpu_now(chip->cpu)));
    if (any) {
        plant_drive_legs(chip->plant, wiring->driven, wiring->state);
    } else {
        plant_trip(chip->plant);
    }
}

void board_pins_changed(board_chip_t *chip)
{
    tim1_outputs(&chip->tim1);
    tim1_check_break(&chip->tim1);
}

void board_set_comparators(board_chip_t *chip)
{
    plant_break_t comparators = {.delay_s = 0.0};
    double full_scale_A = plant_sensor(chip->plant)->i_full_scale_A;
    bool any = false;
    for (int leg = 0; leg < BOARD_LEGS; leg++) {
        double share = 0.0;
        double delay_s = 0.0;
        if (!analog_level(&chip->analog, leg, &share) ||
            !tim1_break_by_comparator(&chip->tim1, leg, &delay_s)) {
            continue;
        }
        if (share <= 0.0) {
            cpu_fail(chip->cpu, "COMP: leg %d has a reference below the amplifiers' mid-scale", leg + 1);
            continue;
        }
        comparators.below_A[leg] = share * full_scale_A;
        comparators.delay_s = delay_s;
        any = true;
    }
    plant_set_break(chip->plant, any ? &comparators : NULL);
}
