/* An image that ends in every way that a program can, with the bridge armed, and after each reset says what
 * the last words are: PASS name | FAIL name: cause status address ... | DONE failed of total. Keep the motor
 * off. Memory map and fault bits are those of ARMv7-M; the rest is hal.h. */
#include <stddef.h>

#include "hal/hal.h"

enum { HARD_FAULT = 3, MEMORY_FAULT = 4, BUS_FAULT = 5, USAGE_FAULT = 6 };

#define INSTRUCTION_ACCESS (1U << 0)
#define DATA_ACCESS        (1U << 1)
#define STACKING           (1U << 4)
#define BUS_DATA           (1U << 9)
#define BUS_STACKING       (1U << 12)
#define UNDEFINED          (1U << 16)

struct app {
    hal_t *hal;
    drive_in_t in;
    drive_out_t out;
};
static struct app the_app;

/* Not cleared by the start-up */
static struct {
    uint32_t magic, step, failed;
} run __attribute__((section(".noinit")));

#define MAGIC 0x0BADF00DU

void app_control(app_t *app)
{
    hal_measure(app->hal, &app->in);
    hal_bridge_write(app->hal, &app->out);
}

void app_slow(app_t *app)
{
    (void)app;
}

void app_monitor(app_t *app)
{
    hal_watchdog(app->hal);
}

/* By way of a variable, so that the compiler does not see where it goes. */
static void touch(uint32_t address)
{
    volatile uintptr_t hidden = address;
    *(volatile uint32_t *)hidden = 1U;
}

static void jump(uintptr_t address)
{
    ((void (*)(void))address)();
}

static void null_pointer(void)
{
    touch(8);
}

static void constant_written(void)
{
    touch(0x08000100U);
}

static void code_written(void)
{
    touch(0x10000400U);
}

static void data_executed(void)
{
    jump((uintptr_t)&the_app | 1U); /* Thumb */
}

static void undefined_instruction(void)
{
    __asm volatile("udf #1");
}

/* As deep as the stack goes, and on */
__attribute__((noinline)) static uint32_t deeper(uint32_t n)
{
    volatile uint32_t room[16] = {n};
    return n == 0U ? room[0] : deeper(n + 1U) + room[n % 16U];
}

static void stack_overflow(void)
{
    (void)deeper(1);
}

typedef struct {
    const char *name;
    void (*provoke)(void);
    uint32_t cause, last_cause; /* one of this range */
    uint32_t status;            /* any of these bits */
} fault_t;

static const fault_t FAULTS[] = {
    {"null pointer", null_pointer, MEMORY_FAULT, MEMORY_FAULT, DATA_ACCESS},
    {"flash written", constant_written, MEMORY_FAULT, MEMORY_FAULT, DATA_ACCESS},
    {"code in CCM SRAM written", code_written, MEMORY_FAULT, MEMORY_FAULT, DATA_ACCESS},
    {"data executed", data_executed, MEMORY_FAULT, MEMORY_FAULT, INSTRUCTION_ACCESS},
    {"undefined instruction", undefined_instruction, USAGE_FAULT, USAGE_FAULT, UNDEFINED},
    /* the guard, or the nothing below it */
    {"stack overflow", stack_overflow, HARD_FAULT, BUS_FAULT,
     DATA_ACCESS | STACKING | BUS_DATA | BUS_STACKING},
};
#define FAULT_COUNT (sizeof FAULTS / sizeof FAULTS[0])

static void say(hal_t *hal, const char *text)
{
    while (*text != '\0') {
        text += hal_console(hal, text);
    }
}

static void say_hex(hal_t *hal, uint32_t number)
{
    char text[] = " 00000000";
    for (size_t n = 0; n < 8U; ++n) {
        text[n + 1U] = "0123456789abcdef"[(number >> (28U - 4U * n)) & 15U];
    }
    say(hal, text);
}

static void judge(hal_t *hal, const fault_t *fault)
{
    hal_last_words_t words = {0};
    const bool found = hal_take_last_words(hal, &words) && hal_reset_cause(hal) == HAL_RESET_SOFTWARE;
    const bool cause = words.cause >= fault->cause && words.cause <= fault->last_cause;
    const bool well = found && cause && (words.status & fault->status) != 0U && !hal_bridge_armed(hal) &&
                      !hal_take_last_words(hal, &words);
    run.failed += well ? 0U : 1U;
    say(hal, well ? "PASS " : "FAIL ");
    say(hal, fault->name);
    if (!well) {
        say_hex(hal, words.cause);
        say_hex(hal, words.status);
        say_hex(hal, words.address);
    }
    say(hal, "\r\n");
}

static void wait_ms(hal_t *hal, uint32_t ms)
{
    const uint32_t since = hal_time_us(hal);
    while (hal_time_us(hal) - since < 1000U * ms) {
        hal_idle(hal);
    }
}

int main(void)
{
    hal_t *hal = hal_instance();
    const hal_config_t config = {
        .timer_counts = PM_CONTRACT_TIMER_COUNTS, .dead_time_ns = 500, .break_level = 0, .can_kbit_s = 500};
    (void)hal_init(hal, &config);
    the_app.hal = hal;
    hal_start(hal, &the_app);
    if (run.magic != MAGIC || hal_reset_cause(hal) == HAL_RESET_POWER) {
        run.magic = MAGIC;
        run.step = 0;
        run.failed = 0;
    } else {
        judge(hal, &FAULTS[run.step]);
        run.step++;
    }
    if (run.step < FAULT_COUNT) {
        wait_ms(hal, 20); /* the console is empty then */
        run.failed += hal_bridge_arm(hal) ? 0U : 1U;
        FAULTS[run.step].provoke();
        say(hal, "FAIL nothing has happened\r\n");
    }
    say(hal, run.failed == 0U ? "DONE 0\r\n" : "DONE with failures\r\n");
    for (;;) {
        hal_idle(hal);
    }
}
