/* Parameters that are the board's to say. */
#include "firmware/app/app_parts.h"
#include "firmware/math/num.h"

static void take(int32_t *parameter, int32_t value)
{
    if (value > 0) {
        *parameter = value;
    }
}

void app_take_board(const hal_t *hal, drive_params_t *params)
{
    const hal_board_t *board = hal_board(hal);
    take(&params->i_full_scale, board->i_full_scale_mA);
    take(&params->v_full_scale, board->v_full_scale_mV);
    take(&params->shunt, board->shunt_uohm);
    take(&params->current_gain, board->current_gain);
    take(&params->voltage_divider, board->voltage_divider);
    take(&params->i_limit, board->i_limit_mA);
    take(&params->v_limit, board->v_limit_mV);
    take(&params->i_bridge, board->i_bridge_mA);
    take(&params->t_bridge, board->t_bridge_ms);
    take(&params->dead_time_least, board->dead_time_least_ns);
    take(&params->f_pwm_least, board->f_pwm_least_Hz);
    take(&params->f_pwm_most, board->f_pwm_most_Hz);
}

/* Powers of voltage and current in a parameter's unit. */
#define OF_VOLTAGE                                                                                           \
    {                                                                                                        \
        1, 0                                                                                                 \
    }
#define OF_CURRENT                                                                                           \
    {                                                                                                        \
        0, 1                                                                                                 \
    }
#define OF_IMPEDANCE                                                                                         \
    {                                                                                                        \
        1, -1                                                                                                \
    }
#define OF_POWER                                                                                             \
    {                                                                                                        \
        1, 1                                                                                                 \
    }

typedef struct {
    drive_param_id_t id;
    struct {
        int8_t v, i;
    } of;
} wound_t;

static const wound_t wound[] = {
    {DRIVE_PARAM_R_s, OF_IMPEDANCE},
    {DRIVE_PARAM_L_d, OF_IMPEDANCE},
    {DRIVE_PARAM_L_q, OF_IMPEDANCE},
    {DRIVE_PARAM_L_q_rated, OF_IMPEDANCE},
    {DRIVE_PARAM_L_dh_rated, OF_IMPEDANCE},
    {DRIVE_PARAM_L_qh_rated, OF_IMPEDANCE},
    {DRIVE_PARAM_L_dqh_rated, OF_IMPEDANCE},
    {DRIVE_PARAM_psi_m, OF_VOLTAGE},
    {DRIVE_PARAM_J, OF_POWER},
    {DRIVE_PARAM_v_dc_nominal, OF_VOLTAGE},
    {DRIVE_PARAM_v_dc_min, OF_VOLTAGE},
    {DRIVE_PARAM_v_dc_derate, OF_VOLTAGE},
    {DRIVE_PARAM_v_dc_max, OF_VOLTAGE},
    {DRIVE_PARAM_v_injection, OF_VOLTAGE},
    {DRIVE_PARAM_device_drop, OF_VOLTAGE},
    {DRIVE_PARAM_i_rated, OF_CURRENT},
    {DRIVE_PARAM_i_max, OF_CURRENT},
    {DRIVE_PARAM_i_trip, OF_CURRENT},
    {DRIVE_PARAM_i_pulse, OF_CURRENT},
    {DRIVE_PARAM_i_open_loop, OF_CURRENT},
    {DRIVE_PARAM_i_fw_max, OF_CURRENT},
    {DRIVE_PARAM_i_d_light, OF_CURRENT},
    {DRIVE_PARAM_offset_max, OF_CURRENT},
    {DRIVE_PARAM_i_noise, OF_CURRENT},
    {DRIVE_PARAM_comp_zone, OF_CURRENT},
};

static int32_t scaled(int32_t value, int32_t power, int32_t now, int32_t preset)
{
    if (power == 0) {
        return value;
    }
    return (int32_t)pm_quotient((int64_t)value * (power > 0 ? now : preset), power > 0 ? preset : now);
}

void app_preset(const hal_t *hal, drive_params_t *params)
{
    drive_params_default(params);
    const int32_t v = params->v_full_scale;
    const int32_t i = params->i_full_scale;
    app_take_board(hal, params);
    for (uint32_t n = 0; n < sizeof wound / sizeof wound[0]; n++) {
        const int32_t of_voltage =
            scaled(drive_param_get(params, wound[n].id), wound[n].of.v, params->v_full_scale, v);
        drive_param_set(params, wound[n].id, scaled(of_voltage, wound[n].of.i, params->i_full_scale, i));
    }
}
