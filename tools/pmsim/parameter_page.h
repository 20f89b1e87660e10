/* The page of the parameter store that holds these parameters, as the firmware itself would write it. */
#ifndef PMSIM_PARAMETER_PAGE_H
#define PMSIM_PARAMETER_PAGE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/params/store.h"
#include "firmware/params/types.h"

/* Returns the number of words that are used; 0, with *refused and *reason, when the drive refuses one. */
uint32_t parameter_page(const drive_params_t *params, uint32_t words[STORE_WORDS], const char **refused,
                        const char **reason);

/* What image foc on the B-G431B-ESC1 says of them, with the board's own scales and limits. */
bool parameter_page_suits_board(const drive_params_t *params, const char **refused, const char **reason);

#endif
