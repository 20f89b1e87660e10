/* Start-up: parameters, hardware, a few lines on the console. */
#include "firmware/app/app.h"

static const char *reset_text(hal_reset_t cause)
{
    switch (cause) {
    case HAL_RESET_POWER:
        return "power-on";
    case HAL_RESET_PIN:
        return "pin";
    case HAL_RESET_SOFTWARE:
        return "software";
    case HAL_RESET_WATCHDOG:
        return "watchdog";
    case HAL_RESET_OTHER:
    default:
        return "other";
    }
}

/* At start-up, waits until the ring has room; no longer than this if nobody empties it. */
#define WAIT_US 50000U

static void put(hal_t *hal, const char *text)
{
    const char *rest = text;
    const uint32_t since = hal_time_us(hal);
    do {
        rest = &rest[hal_console(hal, rest)];
    } while (*rest != '\0' && hal_time_us(hal) - since < WAIT_US);
}

static void say(hal_t *hal, const char *what, const char *value)
{
    put(hal, what);
    put(hal, value);
    put(hal, "\r\n");
}

static void say_hex(hal_t *hal, const char *what, uint32_t value)
{
    static const char digits[] = "0123456789abcdef";
    char text[11];
    text[0] = '0';
    text[1] = 'x';
    for (uint32_t n = 0; n < 8U; n++) {
        text[2U + n] = digits[(value >> (28U - 4U * n)) & 15U];
    }
    text[10] = '\0';
    say(hal, what, text);
}

static void say_last_words(hal_t *hal)
{
    hal_last_words_t words;
    if (hal_take_last_words(hal, &words)) {
        say_hex(hal, "last run ended by exception ", words.cause);
        say_hex(hal, "  pc      ", words.pc);
        say_hex(hal, "  lr      ", words.lr);
        say_hex(hal, "  status  ", words.status);
        say_hex(hal, "  address ", words.address);
    }
}

void app_boot(app_t *app, hal_t *hal)
{
    drive_params_t params;
    uint32_t unknown;
    const bool stored = app_load(hal, &params, &unknown);
    const drive_result_t result = app_configure(app, hal, &params, stored);
    app->dropped = (uint16_t)unknown;
    say(hal, "pmdrive on ", hal_board_name(hal));
    say(hal, "reset: ", reset_text(hal_reset_cause(hal)));
    say_last_words(hal);
    say(hal, "parameters: ", stored ? "stored" : "none stored, the machine may be identified and no more");
    if (unknown > 0U) {
        say_hex(hal, "  of another version, left out: ", unknown);
    }
    if (!result.ok) {
        say(hal, "  refused: ", drive_param_table[result.param].name);
        say(hal, "  ", result.reason);
    } else if (stored && app_ready(app) != APP_READY) {
        say(hal, "  ", "timer, dead time or clock are not what this board can do, or the image is damaged");
    } else {
        /* no further message */
    }
    hal_start(hal, app);
}
