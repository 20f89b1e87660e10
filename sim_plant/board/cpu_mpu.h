/* The memory protection unit of ARMv7-M with eight regions: B3.5. */
#ifndef BOARD_CPU_MPU_H
#define BOARD_CPU_MPU_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { MPU_REGIONS = 8, MPU_FINEST = 32 /* bytes of the smallest region */ };

typedef enum { MPU_READ, MPU_WRITE, MPU_EXECUTE } mpu_access_t;

typedef struct {
    uint32_t control; /* ENABLE, HFNMIENA, PRIVDEFENA */
    uint32_t region;  /* RNR */
    uint32_t base[MPU_REGIONS], attributes[MPU_REGIONS];
} mpu_t;

/* Registers at 0xE000ED90 + offset. False: none there. */
bool mpu_read(const mpu_t *mpu, uint32_t offset, uint32_t *value);
bool mpu_write(mpu_t *mpu, uint32_t offset, uint32_t value);

/* May privileged code do that? `urgent`: in HardFault, NMI or with FAULTMASK. */
bool mpu_allows(const mpu_t *mpu, uint32_t address, mpu_access_t access, bool urgent);

/* May it do everything but execute, anywhere in there? */
bool mpu_is_open(const mpu_t *mpu, uint32_t address, uint32_t size);

#ifdef __cplusplus
}
#endif

#endif
