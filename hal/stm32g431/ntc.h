/* Temperature of the NTC at PB14: 10 kohm at 25 degC, beta 3380 K, to 3.3 V, with 4.7 kohm to ground.
 *   R    = 10 kohm exp(3380 K (1/T - 1/298.15 K))
 *   code = 4096 * 4.7 kohm / (4.7 kohm + R)
 * Straight lines between points at every 10 degC, -40 to 150 degC; 0.6 degC from the curve at most. Called at
 * 1 kHz. Tests: tests/unit/stm32g431/port_test.cpp */
#ifndef STM32G431_NTC_H
#define STM32G431_NTC_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* From a code of 12 bits to 0.1 degC. False, and the highest temperature: broken off or shorted. */
bool ntc_temperature(uint32_t code, int32_t *temperature_dC);

#ifdef __cplusplus
}
#endif

#endif
