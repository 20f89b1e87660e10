/* Instructions that C cannot express. Tests on the host provide their own. */
#ifndef STM32G431_PROCESSOR_H
#define STM32G431_PROCESSOR_H

#ifdef __cplusplus
extern "C" {
#endif

void processor_lock(void); /* interrupts off, faults stay on */
void processor_unlock(void);
void processor_wait(void);    /* sleeps until an interrupt is pending */
void processor_barrier(void); /* waits until all writes have completed */

#ifdef __cplusplus
}
#endif

#endif
