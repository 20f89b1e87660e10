/* Compiled by tests of the build: CHECK is a check of measure.h, PM_CHANNELS what the image carries. */
#define PM_WITHOUT_not_in_image 1
#include "firmware/math/measure.h"

CHECK
