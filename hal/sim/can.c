#include "hal/sim/port.h"

bool sim_queue_put(sim_queue_t *queue, const hal_can_frame_t *frame)
{
    if (queue->count == SIM_FRAMES) {
        return false;
    }
    queue->frame[(queue->first + queue->count) % SIM_FRAMES] = *frame;
    queue->count++;
    return true;
}

bool sim_queue_take(sim_queue_t *queue, hal_can_frame_t *frame)
{
    if (queue->count == 0U) {
        return false;
    }
    *frame = queue->frame[queue->first];
    queue->first = (queue->first + 1U) % SIM_FRAMES;
    queue->count--;
    return true;
}

bool hal_can_receive(hal_t *hal, hal_can_frame_t *frame)
{
    return sim_queue_take(&hal->received, frame);
}

bool hal_can_send(hal_t *hal, const hal_can_frame_t *frame)
{
    return hal->can_state != HAL_CAN_BUS_OFF && sim_queue_put(&hal->sent, frame);
}

hal_can_state_t hal_can_state(const hal_t *hal)
{
    return hal->can_state;
}

uint32_t hal_can_lost(const hal_t *hal)
{
    return hal->can_lost;
}
