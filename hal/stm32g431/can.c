#include "hal/stm32g431/internal.h"
#include "hal/stm32g431/registers/core.h"
#include "hal/stm32g431/registers/fdcan.h"

enum {
    TIME_US = 1000,
    DEFAULT_KBIT_S = 500,
    /* 34 quanta of a bit: 1 + 29 before the sample point, 88 %, and 4 behind it */
    QUANTA = 34,
    BEFORE = 29,
    BEHIND = 4,
    REFUSE = 2, /* of ANFE */
};

/* Data of an element come in words, lowest byte first. */
static uint32_t word_of(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | ((uint32_t)bytes[1] << 8) | ((uint32_t)bytes[2] << 16) |
           ((uint32_t)bytes[3] << 24);
}

static void bytes_of(uint32_t word, uint8_t *bytes)
{
    for (uint32_t n = 0; n < 4U; ++n) {
        bytes[n] = (uint8_t)(word >> (8U * n));
    }
}

hal_status_t can_start(const hal_config_t *config)
{
    const uint32_t wanted = config->can_kbit_s;
    const bool known = wanted == 125U || wanted == 250U || wanted == 500U || wanted == 1000U;
    const uint32_t kbit_s = known ? wanted : (uint32_t)DEFAULT_KBIT_S;
    FDCAN1.CCCR = FDCAN_CCCR_INIT;
    (void)clock_await(&FDCAN1.CCCR, FDCAN_CCCR_INIT, FDCAN_CCCR_INIT, TIME_US);
    FDCAN1.CCCR = FDCAN_CCCR_INIT | FDCAN_CCCR_CCE;
    FDCAN1.NBTP = reg_field(FDCAN_NBTP_NBRP, PORT_CLOCK_HZ / 1000U / QUANTA / kbit_s - 1U) |
                  reg_field(FDCAN_NBTP_NTSEG1, BEFORE - 1U) | reg_field(FDCAN_NBTP_NTSEG2, BEHIND - 1U) |
                  reg_field(FDCAN_NBTP_NSJW, BEHIND - 1U);
    FDCAN1.RXGFC = FDCAN_RXGFC_RRFE | FDCAN_RXGFC_RRFS | reg_field(FDCAN_RXGFC_ANFE, REFUSE);
    FDCAN1.IE = FDCAN_IE_RF0NE | FDCAN_IE_RF0LE;
    FDCAN1.ILE = FDCAN_ILE_EINT0;
    FDCAN1.CCCR = 0U;
    system_interrupt(IRQ_FDCAN1_IT0, PORT_PRIO_IO);
    return known ? HAL_OK : HAL_CAN_BIT_RATE;
}

void can_take_element(port_can_t *can, const fdcan_element_t *element)
{
    if (can->put - can->taken >= PORT_CAN_FRAMES) {
        can->lost++;
        return;
    }
    hal_can_frame_t *frame = &can->frame[can->put % PORT_CAN_FRAMES];
    const uint32_t length = reg_value(FDCAN_FORM_DLC, element->FORM);
    frame->id = (uint16_t)reg_value(FDCAN_HEAD_ID, element->HEAD);
    frame->length = (uint8_t)(length > 8U ? 8U : length);
    bytes_of(element->DATA[0], &frame->data[0]);
    bytes_of(element->DATA[1], &frame->data[4]);
    can->put++;
}

/* Three frames fit into the controller; the ring takes what arrives while the main loop is busy. */
void port_can_received(void)
{
    port_can_t *can = &port_hal.can;
    if ((FDCAN1.IR & FDCAN_IR_RF0L) != 0U) {
        can->lost++;
    }
    FDCAN1.IR = FDCAN_IR_RF0N | FDCAN_IR_RF0L;
    while ((FDCAN1.RXF0S & FDCAN_RXF0S_F0FL) != 0U) {
        const uint32_t index = reg_value(FDCAN_RXF0S_F0GI, FDCAN1.RXF0S);
        can_take_element(can, &FDCANRAM1.RXFIFO0[index]);
        FDCAN1.RXF0A = index;
    }
}

bool hal_can_receive(hal_t *hal, hal_can_frame_t *frame)
{
    port_can_t *can = &hal->can;
    if (can->put == can->taken) {
        return false;
    }
    *frame = can->frame[can->taken % PORT_CAN_FRAMES];
    can->taken++;
    return true;
}

bool hal_can_send(hal_t *hal, const hal_can_frame_t *frame)
{
    (void)hal;
    const uint32_t state = FDCAN1.TXFQS;
    if ((state & FDCAN_TXFQS_TFQF) != 0U) {
        return false;
    }
    const uint32_t index = reg_value(FDCAN_TXFQS_TFQPI, state);
    fdcan_element_t *element = &FDCANRAM1.TXBUF[index];
    element->HEAD = reg_field(FDCAN_HEAD_ID, frame->id);
    element->FORM = reg_field(FDCAN_FORM_DLC, frame->length);
    element->DATA[0] = word_of(&frame->data[0]);
    element->DATA[1] = word_of(&frame->data[4]);
    FDCAN1.TXBAR = 1U << index;
    return true;
}

/* The controller leaves the bus by itself; it returns after 128 times 11 recessive bits once requested. */
hal_can_state_t hal_can_state(const hal_t *hal)
{
    (void)hal;
    const uint32_t state = FDCAN1.PSR;
    if ((state & FDCAN_PSR_BO) != 0U) {
        FDCAN1.CCCR &= ~FDCAN_CCCR_INIT;
        return HAL_CAN_BUS_OFF;
    }
    return (state & FDCAN_PSR_EP) != 0U ? HAL_CAN_PASSIVE : HAL_CAN_ACTIVE;
}

uint32_t hal_can_lost(const hal_t *hal)
{
    return hal->can.lost;
}
