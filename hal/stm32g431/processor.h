/* Instructions that C has no words for. Tests on the host bring their own. */
#ifndef STM32G431_PROCESSOR_H
#define STM32G431_PROCESSOR_H

void processor_lock(void); /* interrupts off, faults stay on */
void processor_unlock(void);
void processor_wait(void);    /* sleeps until an interrupt is pending */
void processor_barrier(void); /* what was written has arrived */

#endif
