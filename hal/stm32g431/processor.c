#include "hal/stm32g431/processor.h"

void processor_lock(void)
{
    __asm volatile("cpsid i" ::: "memory");
}

void processor_unlock(void)
{
    __asm volatile("cpsie i" ::: "memory");
}

void processor_wait(void)
{
    __asm volatile("dsb\n\twfi" ::: "memory");
}

void processor_barrier(void)
{
    __asm volatile("dsb\n\tisb" ::: "memory");
}
