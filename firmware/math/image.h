/* What the image that is being built contains.
 *
 *   PM_IN_IMAGE(name, code)   the code if the method `name` is in the image, else nothing
 *   PM_HAS(name)              1 or 0, also in #if
 *
 * A method is left out by a line `#define PM_WITHOUT_name 1` in the image's header, which is made from its
 * manifest (firmware/images) and named by PM_IMAGE_HEADER. Without such a header everything is in: host,
 * tests, other processors. */
#ifndef PM_MATH_IMAGE_H
#define PM_MATH_IMAGE_H

#ifdef PM_IMAGE_HEADER
#include PM_IMAGE_HEADER
#endif

/* A macro defined as 1 becomes two arguments, of which the second is then 0; any other word is one. */
#define PM_PLACE_1                    0,
#define PM_SECOND(first, second, ...) second
#define PM_IS_ABSENT(...)             PM_SECOND(__VA_ARGS__, 1, 0)
#define PM_IS_PRESENT(macro)          PM_IS_PRESENT_1(macro)
#define PM_IS_PRESENT_1(value)        PM_IS_ABSENT(PM_PLACE_##value 0)
#define PM_KEEP_0(...)
#define PM_KEEP_1(...)         __VA_ARGS__
#define PM_KEEP_IF(has, ...)   PM_KEEP_IF_1(has, __VA_ARGS__)
#define PM_KEEP_IF_1(has, ...) PM_KEEP_##has(__VA_ARGS__)

#define PM_HAS(name)           PM_IS_PRESENT(PM_WITHOUT_##name)
#define PM_IN_IMAGE(name, ...) PM_KEEP_IF(PM_HAS(name), __VA_ARGS__)

/* Bytes of a page of the store (firmware/params/store.h). A board's is one of its flash, which holds what an image has; a program with every method
 * has more to keep. */
#ifndef STORE_PAGE
#ifdef PM_IMAGE_HEADER
#define STORE_PAGE 2048U
#else
#define STORE_PAGE 4096U
#endif
#endif
#endif
