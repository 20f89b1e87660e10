/* Result of a one-shot procedure: calibration, position finding, polarity, identification. */
#ifndef PM_MATH_PROCEDURE_H
#define PM_MATH_PROCEDURE_H

#include <stdint.h>

typedef enum {
    PM_RUNNING,
    PM_DONE,
    PM_FAILED_TIMEOUT,     /* a current did not rise or fall in time */
    PM_FAILED_SALIENCY,    /* the inductances differ too little */
    PM_FAILED_POLARITY,    /* the machine saturates too little */
    PM_FAILED_OFFSET,      /* a sensor's offset is out of range */
    PM_FAILED_NO_CURRENT,  /* the current does not come with the highest voltage */
    PM_FAILED_UNEVEN,      /* the phases do not share the current as they must */
    PM_FAILED_IMPLAUSIBLE, /* a result that no machine has */
    PM_FAILED_NOT_TURNING, /* the rotor did not follow */
    PM_FAILED_TURNED,      /* the rotor was to stand still */
    PM_FAILED_OPEN,        /* no current flows: a wire or a switch is open */
    PM_PROCEDURE_COUNT,
} pm_procedure_t;

/* A margin: how far a result lies above its own noise, in standard deviations, Q8; 0: it has none. */
typedef int32_t pm_sigma_t;
#define PM_SIGMA_BITS 8
#define PM_SIGMA_ONE  (1 << PM_SIGMA_BITS)

#endif
