#include "firmware/drive/fault.h"

const char *drive_fault_text(drive_fault_t fault)
{
    static const char *const text[DRIVE_FAULT_COUNT] = {
        "none",
#define PM_FAULT(name, text) text,
#include "firmware/drive/fault.def"
#undef PM_FAULT
    };
    return fault < DRIVE_FAULT_COUNT ? text[fault] : "unknown";
}
