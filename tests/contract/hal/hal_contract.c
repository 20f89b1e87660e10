#include "tests/contract/hal/hal_contract.h"

#include <stddef.h>

#define COUNT_OF(array) (sizeof(array) / sizeof((array)[0]))
#define MID_SCALE       32768

/* Defined here: the contract is the application. */
struct app {
    hal_t *hal;
    drive_in_t in;
    drive_out_t out;
    volatile uint32_t controls, slows, monitors;
    volatile uint32_t slow_in_control; /* slow that has run before control returned */
    volatile bool in_control, pend;
    volatile bool feed;
    volatile uint32_t breaks; /* measurements that have reported one */
    hal_slow_t slow;
};

static struct app the_app;

void app_control(app_t *app)
{
    app->in_control = true;
    hal_measure(app->hal, &app->in);
    app->breaks += app->in.hw_fault ? 1U : 0U;
    hal_bridge_write(app->hal, &app->out);
    app->controls++;
    if (app->pend) {
        hal_pend_slow(app->hal);
    }
    app->in_control = false;
}

void app_slow(app_t *app)
{
    app->slow_in_control += app->in_control ? 1U : 0U;
    hal_measure_slow(app->hal, &app->slow);
    app->slows++;
}

void app_monitor(app_t *app)
{
    app->monitors++;
    if (app->feed) {
        hal_watchdog(app->hal);
    }
}

typedef struct {
    hal_t *hal;
    const hal_contract_t *contract;
    int checks, failed;
} run_t;

static void say(hal_t *hal, const char *text)
{
    while (*text != '\0') {
        text += hal_console(hal, text); /* the ring empties meanwhile */
    }
}

static void say_number(hal_t *hal, int32_t number)
{
    char digits[12];
    size_t at = sizeof digits - 1;
    uint32_t rest = number < 0 ? 0U - (uint32_t)number : (uint32_t)number;
    digits[at] = '\0';
    do {
        digits[--at] = (char)('0' + rest % 10U);
        rest /= 10U;
    } while (rest > 0U);
    if (number < 0) {
        digits[--at] = '-';
    }
    say(hal, &digits[at]);
}

static void check(run_t *run, const char *name, bool holds, int32_t seen)
{
    run->checks++;
    run->failed += holds ? 0 : 1;
    say(run->hal, holds ? "PASS " : "FAIL ");
    say(run->hal, name);
    if (!holds) {
        say(run->hal, ": ");
        say_number(run->hal, seen);
    }
    say(run->hal, "\r\n");
}

static void wait_us(run_t *run, uint32_t us)
{
    const uint32_t since = hal_time_us(run->hal);
    while (hal_time_us(run->hal) - since < us) {
        run->contract->idle(run->hal);
    }
}

static void set_compare(struct app *app, uint16_t counts)
{
    for (size_t leg = 0; leg < DRIVE_LEGS; leg++) {
        app->out.compare[leg][0] = counts;
        app->out.compare[leg][1] = counts;
    }
}

/* Floating legs */
static void float_all(struct app *app)
{
    set_compare(app, 0);
    app->out.legs = PM_LEGS_OFF;
    app->out.trip = 0;
}

/* Full scales are known, and limits make sense beside them. */
static void check_board(run_t *run)
{
    const hal_board_t *board = hal_board(run->hal);
    check(run, "full scale of the currents", board->i_full_scale_mA >= 100, board->i_full_scale_mA);
    check(run, "full scale of the link", board->v_full_scale_mV >= 5000, board->v_full_scale_mV);
    check(run, "current limit within it", board->i_limit_mA <= board->i_full_scale_mA, board->i_limit_mA);
    check(run, "voltage limit within it", board->v_limit_mV <= board->v_full_scale_mV, board->v_limit_mV);
    check(run, "carriers in order", board->f_pwm_least_Hz <= board->f_pwm_most_Hz, board->f_pwm_least_Hz);
}

static void check_refusals(run_t *run)
{
    const hal_config_t good = run->contract->config;
    hal_config_t bad = good;
    bad.timer_counts = 0;
    check(run, "no timer counts refused", hal_init(run->hal, &bad) == HAL_TIMER_COUNTS, 0);
    check(run, "not armed on refusal", !hal_bridge_arm(run->hal), 0);
    check(run, "configuration taken", hal_init(run->hal, &good) == HAL_OK, 0);
    check(run, "off after init", !hal_bridge_armed(run->hal), 0);
    check(run, "a name", hal_board_name(run->hal)[0] != '\0', 0);
    check_board(run);
    const uint32_t carrier_us = (uint32_t)(2000000ULL * good.timer_counts / hal_timer_Hz(run->hal));
    const int32_t off_us = (int32_t)(carrier_us - run->contract->period_us);
    check(run, "timer clock makes the period", off_us >= -1 && off_us <= 1, off_us);
}

static void check_interrupts(run_t *run)
{
    struct app *app = &the_app;
    wait_us(run, 2000);
    const uint32_t controls = app->controls;
    const uint32_t monitors = app->monitors;
    const uint32_t slows = app->slows;
    wait_us(run, 100000);
    const int32_t expected = (int32_t)(100000U / run->contract->period_us);
    const int32_t seen = (int32_t)(app->controls - controls);
    check(run, "control once per period", seen >= expected - 2 && seen <= expected + 2, seen);
    const int32_t ticks = (int32_t)(app->monitors - monitors);
    check(run, "monitor every millisecond", ticks >= 98 && ticks <= 102, ticks);
    check(run, "slow only when pended", app->slows == slows, (int32_t)(app->slows - slows));
    app->pend = true;
    const uint32_t from = app->controls;
    const uint32_t slow_from = app->slows;
    wait_us(run, 20000);
    app->pend = false;
    const uint32_t pended = app->controls - from; /* at either end one may fall between the lines */
    wait_us(run, 1000);
    const int32_t missed = (int32_t)(pended - (app->slows - slow_from));
    check(run, "slow after each pending", pended > 0U && missed >= -1 && missed <= 1, missed);
    check(run, "slow never within control", app->slow_in_control == 0U, (int32_t)app->slow_in_control);
}

static void check_lock(run_t *run)
{
    struct app *app = &the_app;
    hal_lock(run->hal);
    const uint32_t before = app->controls;
    const uint32_t again = app->controls;
    hal_unlock(run->hal);
    check(run, "nothing runs while locked", before == again, 0);
    wait_us(run, 5000);
    check(run, "control again after unlock", app->controls != before, 0);
}

static void check_measurement(run_t *run)
{
    const struct app *app = &the_app;
    wait_us(run, 2000);
    for (size_t leg = 0; leg < DRIVE_LEGS; leg++) {
        const int32_t off = (int32_t)app->in.i_leg[leg] - MID_SCALE;
        check(run, "no current is mid-scale", off > -2000 && off < 2000, off);
    }
    check(run, "no break", !app->in.hw_fault, 0);
    check(run, "temperature believable",
          app->slow.temperature_missing ||
              (app->slow.temperature_dC > -400 && app->slow.temperature_dC < 1500),
          app->slow.temperature_dC);
}

#if PM_CARRIES(PM_MEASURED)
/* A code between two bounds. */
static void check_code(run_t *run, const char *name, int32_t code, int32_t least, int32_t most)
{
    check(run, name, code >= least && code <= most, code);
}
#endif

/* What the port declares and the program carries, with all legs low: no voltages, no currents. */
static void check_channels(run_t *run)
{
    const uint32_t channels = hal_channels(run->hal);
    check(run, "declares its channels", channels == run->contract->channels, (int32_t)channels);
#if PM_CARRIES(PM_MEASURED)
    const pm_measure_t *more = &the_app.in.more;
#endif
#if PM_CARRIES(NEEDS_CURRENT_MASK)
    check_code(run, "currents valid with all legs low", more->missing, 0, 0);
#endif
#if PM_CARRIES(NEEDS_DC_CURRENT)
    if ((channels & NEEDS_DC_CURRENT) != 0U) {
        check_code(run, "no link current is mid-scale", more->i_dc - MID_SCALE, -2000, 2000);
    }
#endif
#if PM_CARRIES(NEEDS_TERMINALS)
    for (size_t leg = 0; leg < DRIVE_LEGS; leg++) { /* also where there is no such channel */
        check_code(run, "a terminal that is low", more->v_terminal[leg], 0, 2000);
    }
#endif
#if PM_CARRIES(NEEDS_NEUTRAL)
    if ((channels & NEEDS_NEUTRAL) != 0U) {
        check_code(run, "no neutral voltage is mid-scale", more->v_neutral - MID_SCALE, -2000, 2000);
    }
#endif
#if PM_CARRIES(NEEDS_SECOND_SET)
    if ((channels & NEEDS_SECOND_SET) != 0U) {
        for (size_t leg = 0; leg < DRIVE_LEGS; leg++) {
            check_code(run, "no current of a second set is mid-scale", more->i_second[leg] - MID_SCALE, -2000,
                       2000);
        }
    }
#endif
#if PM_CARRIES(NEEDS_SECOND_SET) && PM_CARRIES(NEEDS_NEUTRAL)
    if ((channels & NEEDS_SECOND_SET) != 0U && (channels & NEEDS_NEUTRAL) != 0U) {
        check_code(run, "no neutral voltage of a second set is mid-scale", more->v_neutral_second - MID_SCALE,
                   -2000, 2000);
    }
#endif
#if PM_CARRIES(NEEDS_CAPTURES)
    check_code(run, "no edges with all legs low", more->captures, 0, 0);
#endif
#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
    check_code(run, "no sample that was not asked for", more->sampled, 0, 0);
#endif
}

#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
/* The last that a port can have, with all legs low. */
static void check_samples(run_t *run)
{
    struct app *app = &the_app;
    const uint32_t last = PM_SAMPLES - 1;
    app->out.instants.sample_at[last] = (uint16_t)(run->contract->config.timer_counts + 100U);
    wait_us(run, 1000);
    check_code(run, "the sample that was asked for", app->in.more.sampled, 1 << last, 1 << last);
    for (size_t leg = 0; leg < DRIVE_LEGS; leg++) {
#if PM_SAMPLES_CURRENTS
        check_code(run, "no current is mid-scale in it", app->in.more.i_sample[last][leg] - MID_SCALE, -2000,
                   2000);
#endif
#if PM_CARRIES(NEEDS_TERMINALS)
        check_code(run, "a terminal that is low in it", app->in.more.v_sample[last][leg], 0, 2000);
#endif
    }
    app->out.instants.sample_at[last] = 0;
    wait_us(run, 1000);
    check_code(run, "no sample any more", app->in.more.sampled, 0, 0);
}
#endif

#if PM_CARRIES(NEEDS_SECOND_SAMPLE) && PM_CARRIES(NEEDS_TERMINALS)
/* High between the centres of the zero vectors alone: there are pulses in the sample, none in what is measured at t_k. */
static void check_sample_of_pulses(run_t *run)
{
    struct app *app = &the_app;
    const bool seen = app->in.v_dc > 16000U && (hal_channels(run->hal) & NEEDS_TERMINALS) != 0U;
    const uint16_t half = run->contract->config.timer_counts / 2U;
    set_compare(app, half);
    app->out.instants.sample_at[0] = run->contract->config.timer_counts;
    wait_us(run, 1000);
    for (size_t leg = 0; seen && leg < DRIVE_LEGS; leg++) {
        check_code(run, "a terminal that is high in the sample", app->in.more.v_sample[0][leg], 8000,
                   UINT16_MAX);
        check_code(run, "and low at its ends", app->in.more.v_terminal[leg], 0, 2000);
    }
    app->out.instants.sample_at[0] = 0;
    set_compare(app, 0);
    wait_us(run, 1000);
}
#endif

#if PM_CARRIES(NEEDS_HELD)
/* All alike, so that no current flows. The compare values say the opposite. */
static void check_held(run_t *run)
{
    struct app *app = &the_app;
    set_compare(app, 0);
    app->out.legs = PM_LEGS_ALL(PM_LEG_HIGH);
    wait_us(run, 1000);
    check(run, "stays armed with all legs held high", hal_bridge_armed(run->hal), 0);
#if PM_CARRIES(NEEDS_TERMINALS)
    const bool supplied = app->in.v_dc > 16000U;
    for (size_t leg = 0; supplied && leg < DRIVE_LEGS; leg++) {
        const bool there = (hal_channels(run->hal) & NEEDS_TERMINALS) != 0U;
        check_code(run, "a terminal that is held high", app->in.more.v_terminal[leg], there ? 8000 : 0,
                   there ? UINT16_MAX : 0);
    }
#endif
    set_compare(app, run->contract->config.timer_counts);
    app->out.legs = PM_LEGS_ALL(PM_LEG_LOW);
    wait_us(run, 1000);
    check(run, "stays armed with all legs held low", hal_bridge_armed(run->hal), 0);
#if PM_CARRIES(NEEDS_TERMINALS)
    for (size_t leg = 0; leg < DRIVE_LEGS; leg++) {
        check_code(run, "a terminal that is held low", app->in.more.v_terminal[leg], 0, 2000);
    }
#endif
}
#endif

#if PM_CARRIES(NEEDS_ONE_SWITCH)
/* The lower switches alone for the whole period: all terminals low. The same by a duty of 1 of inverted legs; all high by
 * none. */
static void check_one_switch(run_t *run)
{
    struct app *app = &the_app;
    set_compare(app, 0);
    app->out.legs = PM_LEGS_ALL(PM_LEG_LOWER);
    wait_us(run, 1000);
    check(run, "stays armed with one switch of each leg", hal_bridge_armed(run->hal), 0);
    for (size_t leg = 0; leg < DRIVE_LEGS; leg++) {
        const int32_t off = (int32_t)app->in.i_leg[leg] - MID_SCALE;
        check(run, "no current with the lower switches alone", off > -2000 && off < 2000, off);
#if PM_CARRIES(NEEDS_TERMINALS)
        check_code(run, "a terminal on its lower switch", app->in.more.v_terminal[leg], 0, 2000);
#endif
    }
    app->out.legs = PM_LEGS_ALL(PM_LEG_INVERTED);
    for (size_t high = 0; high < 2; high++) {
        for (size_t leg = 0; leg < DRIVE_LEGS; leg++) {
            const uint16_t all = (uint16_t)run->contract->config.timer_counts;
            app->out.compare[leg][0] = high != 0 ? 0U : all;
            app->out.compare[leg][1] = app->out.compare[leg][0];
        }
        wait_us(run, 1000);
        check(run, "stays armed with inverted legs", hal_bridge_armed(run->hal), 0);
#if PM_CARRIES(NEEDS_TERMINALS)
        const bool seen = app->in.v_dc > 16000U && (hal_channels(run->hal) & NEEDS_TERMINALS) != 0U;
        for (size_t leg = 0; seen && leg < DRIVE_LEGS; leg++) {
            check_code(run, "a terminal of an inverted leg", app->in.more.v_terminal[leg],
                       high != 0 ? 8000 : 0, high != 0 ? UINT16_MAX : 2000);
        }
#endif
    }
}
#endif

#if PM_CARRIES(NEEDS_COMMUTATE)
/* Low at the start of the period, high at its end, where the terminals are measured. */
static void check_commutate(run_t *run)
{
    struct app *app = &the_app;
    app->out.legs = PM_LEGS_ALL(PM_LEG_LOW);
    app->out.instants.then = PM_LEGS_ALL(PM_LEG_HIGH);
    for (size_t early = 0; early < 2; early++) {
        app->out.instants.commutate_at =
            early != 0 ? 1U : (uint16_t)(run->contract->config.timer_counts + 100U);
        wait_us(run, 1000);
        check(run, "stays armed while the legs commutate", hal_bridge_armed(run->hal), 0);
#if PM_CARRIES(NEEDS_TERMINALS)
        const bool seen = app->in.v_dc > 16000U && (hal_channels(run->hal) & NEEDS_TERMINALS) != 0U;
        for (size_t leg = 0; seen && leg < DRIVE_LEGS; leg++) {
            check_code(run, "a terminal that has become high", app->in.more.v_terminal[leg], 8000,
                       UINT16_MAX);
        }
#endif
    }
#if PM_CARRIES(NEEDS_TERMINALS)
    /* What was held follows its duty from the commutation on, in the same period. */
    app->out.legs = PM_LEGS_ALL(PM_LEG_HIGH);
    app->out.instants.then = PM_LEGS_ALL(PM_LEG_PWM);
    set_compare(app, 0);
    wait_us(run, 1000);
    for (size_t leg = 0; leg < DRIVE_LEGS; leg++) {
        check_code(run, "a terminal that was high and is chopped", app->in.more.v_terminal[leg], 0, 2000);
    }
    app->out.legs = PM_LEGS_ALL(PM_LEG_LOW);
#endif
    app->out.instants.commutate_at = 0;
    wait_us(run, 1000);
#if PM_CARRIES(NEEDS_TERMINALS)
    for (size_t leg = 0; leg < DRIVE_LEGS; leg++) {
        check_code(run, "a terminal that no longer does", app->in.more.v_terminal[leg], 0, 2000);
    }
#endif
}
#endif

static void check_legs(run_t *run)
{
    const uint32_t channels = hal_channels(run->hal);
    check_channels(run);
#if PM_CARRIES(NEEDS_SECOND_SAMPLE)
    if ((channels & NEEDS_SECOND_SAMPLE) != 0U) {
        check_samples(run);
#if PM_CARRIES(NEEDS_TERMINALS)
        check_sample_of_pulses(run);
#endif
    }
#endif
#if PM_CARRIES(NEEDS_HELD)
    if ((channels & NEEDS_HELD) != 0U) {
        check_held(run);
    }
#endif
#if PM_CARRIES(NEEDS_ONE_SWITCH)
    if ((channels & NEEDS_ONE_SWITCH) != 0U) {
        check_one_switch(run);
    }
#endif
#if PM_CARRIES(NEEDS_COMMUTATE)
    if ((channels & NEEDS_COMMUTATE) != 0U) {
        check_commutate(run);
    }
#endif
    (void)channels;
}

static void check_bridge(run_t *run)
{
    struct app *app = &the_app;
    float_all(app);
    check(run, "arms", hal_bridge_arm(run->hal), 0);
    check(run, "is armed", hal_bridge_armed(run->hal), 0);
    wait_us(run, 1000);
    app->out.legs = PM_LEGS_PWM; /* compare 0: all low */
    wait_us(run, 1000);
    check(run, "stays armed with all legs low", hal_bridge_armed(run->hal), 0);
    check_legs(run);
    app->out.trip = 1;
    wait_us(run, 1000);
    check(run, "a trip disarms", !hal_bridge_armed(run->hal), 0);
    float_all(app);
    wait_us(run, 1000);
    check(run, "a trip is not forgotten", !hal_bridge_armed(run->hal), 0);
    check(run, "arms again", hal_bridge_arm(run->hal), 0);
    hal_bridge_off(run->hal);
    check(run, "off at once", !hal_bridge_armed(run->hal), 0);
}

/* Its cause is gone at once. */
static void check_break(run_t *run)
{
    struct app *app = &the_app;
    check(run, "armed for a break", hal_bridge_arm(run->hal), 0);
    wait_us(run, 1000);
    const uint32_t before = app->breaks;
    hal_lock(run->hal); /* before a measurement can have reported it */
    run->contract->cut(run->hal);
    const bool stays = hal_bridge_armed(run->hal);
    const bool again = hal_bridge_arm(run->hal);
    hal_unlock(run->hal);
    check(run, "a break disarms at once", !stays, 0);
    check(run, "not armed before the break is reported", !again, 0);
    wait_us(run, 1000);
    check(run, "a break is reported once", app->breaks == before + 1U, (int32_t)(app->breaks - before));
    check(run, "a break is not forgotten", !hal_bridge_armed(run->hal), 0);
    check(run, "arms after a break", hal_bridge_arm(run->hal), 0);
    wait_us(run, 1000);
    check(run, "stays armed after a break", hal_bridge_armed(run->hal), 0);
    hal_bridge_off(run->hal);
}

static bool page_is(const hal_t *hal, uint32_t page, uint32_t first, uint32_t second)
{
    const uint32_t *words = hal_store_page(hal, page);
    return words[0] == first && words[1] == second;
}

static void check_store(run_t *run)
{
    static const uint32_t data[2] = {0x12345678U, 0x9ABCDEF0U};
    hal_t *hal = run->hal;
    the_app.feed = true;
    for (uint32_t page = 0; page < HAL_STORE_PAGES; page++) {
        check(run, "page erases", hal_store_erase(hal, page) && page_is(hal, page, UINT32_MAX, UINT32_MAX),
              (int32_t)page);
        check(run, "page is written",
              hal_store_write(hal, page, 0, data, 8) && page_is(hal, page, data[0], data[1]), (int32_t)page);
    }
    check(run, "end of the page is written", hal_store_write(hal, 0, HAL_STORE_PAGE_SIZE - 8U, data, 8), 0);
    check(run, "beyond the page refused", !hal_store_write(hal, 0, HAL_STORE_PAGE_SIZE, data, 8), 0);
    check(run, "odd offset refused", !hal_store_write(hal, 0, 20, data, 8), 0);
    check(run, "odd size refused", !hal_store_write(hal, 0, 16, data, 4), 0);
    check(run, "no such page refused", !hal_store_erase(hal, HAL_STORE_PAGES), 0);
    check(run, "armed for the next check", hal_bridge_arm(hal), 0);
    check(run, "no erasing while armed", !hal_store_erase(hal, 0), 0);
    check(run, "no writing while armed", !hal_store_write(hal, 0, 16, data, 8), 0);
    hal_bridge_off(hal);
    check(run, "page kept", page_is(hal, 0, data[0], data[1]), 0);
}

static void check_bus(run_t *run)
{
    hal_can_frame_t frame;
    check(run, "no frame waits", !hal_can_receive(run->hal, &frame), 0);
    check(run, "bus not off", hal_can_state(run->hal) != HAL_CAN_BUS_OFF, 0);
    check(run, "none lost", hal_can_lost(run->hal) == 0U, 0);
}

int hal_contract_run(hal_t *hal, const hal_contract_t *contract)
{
    run_t run = {.hal = hal, .contract = contract};
    the_app = (struct app){.hal = hal, .feed = true};
    check_refusals(&run);
    float_all(&the_app);
    hal_start(hal, &the_app);
    check_interrupts(&run);
    check_lock(&run);
    check_measurement(&run);
    check_bridge(&run);
    if (contract->cut != NULL) {
        check_break(&run);
    }
    check_store(&run);
    check_bus(&run);
    say(hal, "DONE ");
    say_number(hal, run.failed);
    say(hal, " of ");
    say_number(hal, run.checks);
    say(hal, "\r\n");
    return run.failed;
}
