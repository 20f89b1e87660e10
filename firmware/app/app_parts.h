/* Interface between the parts of the application. */
#ifndef APP_APP_PARTS_H
#define APP_APP_PARTS_H

#include "firmware/app/app.h"

#ifdef __cplusplus
extern "C" {
#endif

/* app.c */
hal_config_t app_hal_config(const drive_params_t *params, uint16_t can_kbit_s);
void app_trip(app_t *app, drive_fault_t fault);
bool app_may_run(const app_t *app); /* in this mode: a machine that is not known may be identified alone */

/* app_bus.c: the node and the drive profile */
void app_bus_init(app_t *app);
bool app_bus_take(app_t *app); /* the frames that have come; false: none */
void app_bus_run(app_t *app);
bool app_is_on(const app_t *app); /* the bridge is on, or about to be */

/* app_values.c: what is shown of the drive; false: not one of these */
bool app_value(app_t *app, uint16_t slot, int32_t *value);
cia402_in_t app_drive_facts(const app_t *app);
int32_t app_in_units(pm_q_t x, pm_num_t base,
                     int exponent); /* of 10^-exponent SI; what does not fit is limited */
int32_t app_torque_uNm(const app_t *app, int32_t permille);

/* app_identification.c */
bool app_identify_value(const app_t *app, uint16_t slot, int32_t *value); /* false: not one of these */
bool app_identify_put(app_t *app, uint16_t slot, int32_t value);
void app_identify_command(const app_t *app, drive_command_t *command); /* with what was left open */

/* app_board.c: what the board's schematic says, in 2001h and 2700h; presets: their motor, wound for this board */
void app_take_board(const hal_t *hal, drive_params_t *params);
void app_preset(const hal_t *hal, drive_params_t *params);

/* app_parameters.c: abort codes */
uint32_t app_put_parameter(app_t *app, drive_param_id_t id, int32_t value);
uint32_t app_put_batch(app_t *app, bool open);
uint32_t app_refused_object(const app_t *app);
void app_judge_parameters(app_t *app); /* a fault where nothing may run with them */
void app_take_parameters(app_t *app);  /* slow, when next_ready is set */

/* app_store.c */
bool app_stored_value(const hal_t *hal, uint16_t index, uint8_t sub, int32_t *value);
uint32_t app_store_group(app_t *app, uint32_t group,
                         bool keep); /* keep: the present values; else none. Abort code */
void app_recall(app_t *app, od_kind_t kind);

#ifdef __cplusplus
}
#endif

#endif
