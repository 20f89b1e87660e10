/* Replays a record of `pmsim record` on the target: the outputs must be the recorded bits, and every call of
 * step_*() is one control period to be counted, by mode. */
#include <stdio.h>
#include <string.h>

#include "firmware/drive/drive_state.h"
#include "firmware/params/parameters.h"
#include "tools/pmsim/record_layout.h"

/* Wrappers tell the modes apart; each adds its call, two instructions and its mark. */
#define MODE(name, mark)                                                                                     \
    void step_##name(drive_t *d, const drive_in_t *in, drive_out_t *out);                                    \
    __attribute__((noinline, noclone)) void step_##name(drive_t *d, const drive_in_t *in, drive_out_t *out)  \
    {                                                                                                        \
        __asm volatile(mark);                                                                                \
        drive_step(d, in, out);                                                                              \
    }
MODE(flux, "")
MODE(injection, "nop")
MODE(start, "nop\nnop")

static drive_t drive;

static void step(const drive_in_t *in, drive_out_t *out)
{
    if (drive.stage != STAGE_VECTOR) {
        step_start(&drive, in, out);
    } else if (drive.position.inject) {
        step_injection(&drive, in, out);
    } else {
        step_flux(&drive, in, out);
    }
}

/* A target without NEEDS_HALVES gives the first half of the carrier alone, for both. */
static bool same_leg(const uint16_t given[2], const uint16_t recorded[2])
{
    const uint16_t second = PM_CARRIES(NEEDS_HALVES) ? given[1] : given[0];
    return given[0] == recorded[0] && second == recorded[1];
}

static bool same(const record_period_t *r, const drive_out_t *out)
{
    for (uint32_t x = 0; x < RECORD_LEGS; x++) {
        if ((pm_leg(out->legs, x) != PM_LEG_OFF) != (r->driven[x] != 0U)) {
            return false;
        }
        if (pm_leg(out->legs, x) != PM_LEG_OFF && !same_leg(out->compare[x], r->compare[x])) {
            return false;
        }
    }
    return true;
}

static void give(const record_period_t *r)
{
    if ((r->given & RECORD_COMMAND) != 0U) {
        const drive_command_t command = {.enable = r->enable != 0U,
                                         .mode = (drive_mode_t)r->mode,
                                         .speed_mrad_s = r->speed_mrad_s,
                                         .torque_uNm = r->torque_uNm,
                                         .current_mA = r->current_mA,
                                         PM_IN_IMAGE(six_step, .duty_ppm = r->duty_ppm)};
        drive_command(&drive, &command);
    }
    if ((r->given & RECORD_CLEAR) != 0U) {
        (void)drive_clear_fault(&drive);
    }
}

static bool read_param(FILE *file, int32_t *value, uint32_t *count)
{
    (*count)++;
    return fread(value, sizeof *value, 1, file) == 1;
}

/* The host recorded all; those that an image does not have are left out. */
static bool read_params(FILE *file, drive_params_t *params, uint32_t expected)
{
    bool good = true;
    uint32_t count = 0;
    int32_t absent;
#define PM_PARAM(name, unit, exp10, min, def, max, help)                                                     \
    good = good && read_param(file, &params->name, &count);
#define PM_NO_PARAM(name) good = good && read_param(file, &absent, &count);
#include "firmware/params/parameters.def"
#undef PM_PARAM
    (void)absent;
    params->absent = 0;
    return good && count == expected;
}

static bool open_record(FILE *file, record_header_t *header)
{
    drive_params_t params;
    if (fread(header, sizeof *header, 1, file) != 1 ||
        memcmp(header->magic, RECORD_MAGIC, sizeof header->magic) != 0 ||
        header->period_bytes != sizeof(record_period_t)) {
        return false;
    }
    return read_params(file, &params, header->parameters) && drive_init(&drive, &params, PM_CHANNELS).ok;
}

/* Of a program with all methods and channels, as the host has them; an image has less memory. */
static bool same_layout(const record_header_t *header)
{
#ifdef PM_IMAGE_HEADER
    (void)header;
    return true;
#else
    uint32_t layout[RECORD_LAYOUT];
    record_layout(layout);
    bool same = true;
    for (unsigned k = 0; k < RECORD_LAYOUT; k++) {
        if (layout[k] != header->layout[k]) {
            printf("replay: item %u of record_layout() is %lu, on the host %lu\n", k,
                   (unsigned long)layout[k], (unsigned long)header->layout[k]);
            same = false;
        }
    }
    return same;
#endif
}

int main(int argc, char **argv)
{
    FILE *file = argc > 1 ? fopen(argv[1], "rb") : NULL;
    record_header_t header;
    if (file == NULL || !open_record(file, &header)) {
        printf("replay: no record of this firmware in the file given\n");
        return 1;
    }
    if (!same_layout(&header)) {
        return 1;
    }
    uint32_t different = 0;
    static record_period_t r[64]; /* 16 KiB of RAM must do on the smallest board */
    for (uint32_t k = 0; k < header.periods;) {
        const uint32_t n = (uint32_t)fread(r, sizeof r[0], sizeof r / sizeof r[0], file);
        if (n == 0U) {
            printf("replay: the record ends at period %lu\n", (unsigned long)k);
            return 1;
        }
        for (uint32_t j = 0; j < n; j++, k++) {
            give(&r[j]);
            const drive_in_t in = {.i_leg = {r[j].i_leg[0], r[j].i_leg[1], r[j].i_leg[2]},
                                   .v_dc = r[j].v_dc,
                                   .hw_fault = r[j].hw_fault != 0U};
            drive_out_t out;
            step(&in, &out);
            different += same(&r[j], &out) ? 0U : 1U;
            if (k % header.slow_divider == 0U) {
                const drive_slow_in_t slow = {.temperature_dC = r[j].temperature_dC};
                drive_slow(&drive, &slow);
            }
        }
    }
    printf("replay: %lu of %lu periods differ from the host\n", (unsigned long)different,
           (unsigned long)header.periods);
    return different == 0U ? 0 : 1;
}
