/* Of board.h: what is not the chip. */
#include "sim_plant/board/board.h"

#include "sim_plant/board/board_inside.h"

#include <string.h>

void board_program(board_t *board, uint32_t address, const void *data, size_t size)
{
    uint8_t *to = cpu_memory(board_cpu(board), address, (uint32_t)size);
    if (!to || address - FLASH_BASE >= FLASH_SIZE) {
        cpu_fail(board_cpu(board), "board_program: 0x%08x is not flash", (unsigned)address);
        return;
    }
    memcpy(to, data, size);
    cpu_code_changed(board_cpu(board), address, (uint32_t)size);
}

void board_read_flash(board_t *board, uint32_t address, void *data, size_t size)
{
    const uint8_t *from = cpu_memory(board_cpu(board), address, (uint32_t)size);
    if (from) {
        memcpy(data, from, size);
    }
}

bool board_can_send(board_t *board, const board_frame_t *frame)
{
    fdcan_frame_t out = {.id = frame->id, .length = frame->length};
    memcpy(out.data, frame->data, sizeof out.data);
    return fdcan_put(&board_inside(board)->fdcan, &out);
}

unsigned board_can_waiting(board_t *board)
{
    const fdcan_queue_t *queue = &board_inside(board)->fdcan.to_image;
    return queue->put - queue->taken;
}

bool board_can_receive(board_t *board, board_frame_t *frame)
{
    fdcan_frame_t in;
    if (!fdcan_take(&board_inside(board)->fdcan, &in)) {
        return false;
    }
    *frame = (board_frame_t){.id = in.id, .length = in.length};
    memcpy(frame->data, in.data, sizeof in.data);
    return true;
}

void board_can_error(board_t *board, bool bus_off)
{
    fdcan_error(&board_inside(board)->fdcan, bus_off);
}

const char *board_console(board_t *board)
{
    return board_inside(board)->usart.text;
}

bool board_led(board_t *board)
{
    return gpio_drives_high(&board_inside(board)->gpio, PORT_C, 6);
}

void board_set_temperature(board_t *board, double temperature_degC)
{
    board_inside(board)->wiring.temperature_degC = temperature_degC;
}

void board_set_dial(board_t *board, double fraction)
{
    board_inside(board)->wiring.dial = fraction;
}

void board_press_button(board_t *board, bool pressed)
{
    board_inside(board)->wiring.button = pressed;
}

void board_hold_break(board_t *board, bool held)
{
    board_inside(board)->wiring.break_held = held;
    tim1_check_break(&board_inside(board)->tim1);
}

void board_pulse_break(board_t *board, double after_s, double width_s)
{
    const rcc_t *rcc = &board_inside(board)->rcc;
    uint64_t from = cpu_now(board_cpu(board)) + rcc_cycles(rcc, after_s);
    tim1_pulse_break(&board_inside(board)->tim1, from, rcc_cycles(rcc, width_s));
}

void board_halt(board_t *board, bool halted)
{
    board_chip_t *chip = board_inside(board);
    cpu_halt(board_cpu(board), halted);
    if (board_misc_freezes_iwdg(&chip->misc)) {
        iwdg_freeze(&chip->iwdg, halted);
    }
    if (board_misc_freezes_tim1(&chip->misc)) {
        tim1_freeze(&chip->tim1, halted);
    }
}

void board_stick_converter(board_t *board, bool stuck)
{
    board_chip_t *chip = board_inside(board);
    chip->wiring.converter_stuck = stuck;
    adc_release(&chip->adc);
}

void board_stop_oscillator(board_t *board, bool stopped)
{
    board_inside(board)->wiring.oscillator_stopped = stopped;
    rcc_oscillator(&board_inside(board)->rcc, stopped);
}

void board_fail_pll(board_t *board, bool fails)
{
    board_inside(board)->wiring.pll_fails = fails;
}

void board_set_supply(board_t *board, double supply_V)
{
    board_inside(board)->wiring.supply_V = supply_V;
    tim1_check_break(&board_inside(board)->tim1);
}

void board_check_parity(board_t *board, bool checked)
{
    board_inside(board)->wiring.parity = checked;
}

void board_flip_ram(board_t *board)
{
    board_chip_t *chip = board_inside(board);
    if (chip->wiring.parity) {
        board_misc_parity_error(&chip->misc);
        tim1_check_break(&chip->tim1);
        cpu_irq(chip->cpu, CPU_NMI, true);
    }
}

void board_cut_flash(board_t *board, uint32_t after_words)
{
    board_inside(board)->flash.cut_after = after_words;
}
