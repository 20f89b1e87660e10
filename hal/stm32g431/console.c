#include "hal/stm32g431/internal.h"
#include "hal/stm32g431/registers/core.h"
#include "hal/stm32g431/registers/usart.h"

enum { BAUD = 115200 };

void console_start(uint32_t clock_Hz)
{
    USART2.BRR = (clock_Hz + BAUD / 2U) / BAUD;
    USART2.CR1 = USART_CR1_UE | USART_CR1_TE;
    system_interrupt(IRQ_USART2, PORT_PRIO_IO);
}

void port_console_sent(void)
{
    port_console_t *console = &port_hal.console;
    if (console->put == console->taken) {
        USART2.CR1 = USART_CR1_UE | USART_CR1_TE;
    } else if ((USART2.ISR & USART_ISR_TXE) != 0U) {
        USART2.TDR = (uint8_t)console->text[console->taken % PORT_CONSOLE_SIZE];
        console->taken++;
    } else {
        /* some other cause, none is enabled */
    }
}

uint32_t hal_console(hal_t *hal, const char *text)
{
    port_console_t *console = &hal->console;
    uint32_t count = 0;
    while (text[count] != '\0' && console->put - console->taken < PORT_CONSOLE_SIZE) {
        console->text[console->put % PORT_CONSOLE_SIZE] = text[count];
        console->put++;
        ++count;
    }
    USART2.CR1 = USART_CR1_UE | USART_CR1_TE | USART_CR1_TXEIE;
    return count;
}

void hal_led(hal_t *hal, bool on)
{
    (void)hal;
    pins_led(on);
}
