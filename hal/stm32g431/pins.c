/* Pins of the board. After reset every pin is analog but those of the debugger, so analog ones need nothing:
 * PA0 V bus, PA1 to PA3 amplifier U, PA5 to PA7 amplifier V, PB0 to PB2 amplifier W, PA4, PC4 and PB11
 * terminals (PB11 or neutral), PB12 dial, PB14 NTC. */
#include "hal/stm32g431/internal.h"
#include "hal/stm32g431/registers/gpio.h"

enum { MODE_INPUT, MODE_OUTPUT, MODE_FUNCTION };
enum { PULL_NONE, PULL_UP, PULL_DOWN };
enum { SLOW, MEDIUM, FAST };

typedef struct {
    gpio_t *port;
    uint8_t pin, mode, function, pull, speed;
    bool high; /* first level of an output */
} pin_t;

static const pin_t PINS[] = {
    /* Gates: low when the timer does not drive them. */
    {&GPIOA, 8, MODE_FUNCTION, 6, PULL_DOWN, FAST, false},  /* TIM1_CH1 */
    {&GPIOA, 9, MODE_FUNCTION, 6, PULL_DOWN, FAST, false},  /* TIM1_CH2 */
    {&GPIOA, 10, MODE_FUNCTION, 6, PULL_DOWN, FAST, false}, /* TIM1_CH3 */
    {&GPIOC, 13, MODE_FUNCTION, 4, PULL_DOWN, SLOW, false}, /* TIM1_CH1N; this pin cannot be fast */
    {&GPIOA, 12, MODE_FUNCTION, 6, PULL_DOWN, FAST, false}, /* TIM1_CH2N */
    {&GPIOB, 15, MODE_FUNCTION, 4, PULL_DOWN, FAST, false}, /* TIM1_CH3N */
    {&GPIOA, 15, MODE_FUNCTION, 9, PULL_DOWN, SLOW, false}, /* TIM1_BKIN: pad PWM; high switches off */
    {&GPIOA, 11, MODE_FUNCTION, 9, PULL_UP, SLOW, false},   /* FDCAN1_RX */
    {&GPIOB, 9, MODE_FUNCTION, 9, PULL_NONE, MEDIUM, true}, /* FDCAN1_TX */
    {&GPIOB, 3, MODE_FUNCTION, 7, PULL_NONE, SLOW, false},  /* USART2_TX */
    {&GPIOB, 5, MODE_OUTPUT, 0, PULL_NONE, SLOW,
     false}, /* GPIO_BEMF: low switches the dividers of the terminals on, which keeps their pins in range */
    {&GPIOC, 6, MODE_OUTPUT, 0, PULL_NONE, SLOW, false},  /* STATUS LED */
    {&GPIOC, 10, MODE_INPUT, 0, PULL_UP, SLOW, false},    /* BUTTON */
    {&GPIOC, 11, MODE_OUTPUT, 0, PULL_NONE, SLOW, false}, /* CAN_SHDN: transceiver on */
    {&GPIOC, 14, MODE_OUTPUT, 0, PULL_NONE, SLOW, true},  /* CAN_TERM: 120 ohm across the bus */
};
enum { LED_PIN = 6, BUTTON_PIN = 10 };

/* One field of `width` bits per pin. */
static void set_field(reg_t *word, uint32_t index, uint32_t width, uint32_t value)
{
    const uint32_t mask = ((1U << width) - 1U) << (index * width);
    *word = (*word & ~mask) | (value << (index * width));
}

static void set_level(gpio_t *port, uint32_t pin, bool high)
{
    port->BSRR = 1U << (high ? pin : pin + 16U);
}

void pins_start(void)
{
    for (uint32_t n = 0; n < sizeof PINS / sizeof PINS[0]; ++n) {
        const pin_t *p = &PINS[n];
        set_level(p->port, p->pin, p->high);
        set_field(&p->port->AFR[p->pin / 8U], p->pin % 8U, 4U, p->function);
        set_field(&p->port->OSPEEDR, p->pin, 2U, p->speed);
        set_field(&p->port->PUPDR, p->pin, 2U, p->pull);
        set_field(&p->port->MODER, p->pin, 2U, p->mode);
    }
}

bool pins_button(void)
{
    return (GPIOC.IDR & (1U << BUTTON_PIN)) == 0U;
}

void pins_led(bool on)
{
    set_level(&GPIOC, LED_PIN, on);
}
