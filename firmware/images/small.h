/* What the image of the board does without (firmware/math/image.h). */
#ifndef IMAGES_SMALL_H
#define IMAGES_SMALL_H

#define PM_WITHOUT_ekf_full     1
#define PM_WITHOUT_ekf_reduced  1
#define PM_WITHOUT_mras_current 1
#define PM_WITHOUT_mras_voltage 1
#define PM_WITHOUT_mras_simple  1
#define PM_WITHOUT_mismatch     1

#endif
