/* CAN controller and its message memory: RM0440 44. */
#ifndef REGISTERS_FDCAN_H
#define REGISTERS_FDCAN_H

#include "hal/stm32g431/registers/register.h"

typedef struct {
    uint32_t reserved_0[6];
    reg_t CCCR;
    reg_t NBTP;
    uint32_t reserved_20[9];
    reg_t PSR;
    uint32_t reserved_48[2];
    reg_t IR;
    reg_t IE;
    reg_t ILS;
    reg_t ILE;
    uint32_t reserved_60[8];
    reg_t RXGFC;
    uint32_t reserved_84[3];
    reg_t RXF0S;
    reg_t RXF0A;
    uint32_t reserved_98[10];
    reg_t TXBC;
    reg_t TXFQS;
    uint32_t reserved_c8;
    reg_t TXBAR;
} fdcan_t;

#define FDCAN_CCCR_INIT   (1U << 0)
#define FDCAN_CCCR_CCE    (1U << 1)
#define FDCAN_NBTP_NTSEG2 (0x7FU << 0)
#define FDCAN_NBTP_NTSEG1 (0xFFU << 8)
#define FDCAN_NBTP_NBRP   (0x1FFU << 16)
#define FDCAN_NBTP_NSJW   (0x7FU << 25)
#define FDCAN_PSR_EP      (1U << 5)
#define FDCAN_PSR_BO      (1U << 7)
#define FDCAN_IR_RF0N     (1U << 0)
#define FDCAN_IR_RF0L     (1U << 2)
#define FDCAN_IE_RF0NE    (1U << 0)
#define FDCAN_IE_RF0LE    (1U << 2)
#define FDCAN_ILE_EINT0   (1U << 0)
#define FDCAN_RXGFC_RRFE  (1U << 0)
#define FDCAN_RXGFC_RRFS  (1U << 1)
#define FDCAN_RXGFC_ANFE  (3U << 2) /* 2: refuse */
#define FDCAN_RXGFC_ANFS  (3U << 4) /* 0: into FIFO 0 */
#define FDCAN_RXF0S_F0FL  (0xFU << 0)
#define FDCAN_RXF0S_F0GI  (3U << 8)
#define FDCAN_RXF0A_F0AI  (7U << 0)
#define FDCAN_TXFQS_TFQPI (3U << 16)
#define FDCAN_TXFQS_TFQF  (1U << 21)

/* An element of 18 words, of which a classic frame uses four. */
typedef struct {
    reg_t HEAD; /* R0, T0 */
    reg_t FORM; /* R1, T1 */
    reg_t DATA[16];
} fdcan_element_t;

#define FDCAN_HEAD_ID  (0x7FFU << 18)
#define FDCAN_FORM_DLC (0xFU << 16)

typedef struct {
    uint32_t filters[44];
    fdcan_element_t RXFIFO0[3];
    fdcan_element_t RXFIFO1[3];
    uint32_t events[6];
    fdcan_element_t TXBUF[3];
} fdcan_ram_t;

extern fdcan_t FDCAN1;
extern fdcan_ram_t FDCANRAM1;

#endif
