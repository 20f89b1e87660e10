/* State of a one-shot procedure: position finding, identification. */
#ifndef PM_MATH_PROCEDURE_H
#define PM_MATH_PROCEDURE_H

typedef enum {
    PM_RUNNING,
    PM_DONE,
    PM_FAILED_TIMEOUT,  /* a current did not behave in time */
    PM_FAILED_SALIENCY, /* no usable difference of inductance */
    PM_FAILED_POLARITY, /* no usable saturation */
} pm_procedure_t;

#endif
