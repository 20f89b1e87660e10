/* State of a one-shot procedure: position finding, identification. */
#ifndef PM_MATH_PROCEDURE_H
#define PM_MATH_PROCEDURE_H

typedef enum {
    PM_RUNNING,
    PM_DONE,
    PM_FAILED_TIMEOUT,  /* a current did not rise or fall in time */
    PM_FAILED_SALIENCY, /* the inductances differ too little */
    PM_FAILED_POLARITY, /* the machine saturates too little */
} pm_procedure_t;

#endif
