/* Functions of known length, for the test of the counter itself. Assembly, so no compiler can change it. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

int32_t known_leaf(int32_t x);
int32_t known_loop(int32_t n);
int32_t known_tail(int32_t x);
int32_t known_nested(int32_t x);
int32_t known_skipped_call(int32_t x);

#if defined(__riscv)
#define FUNCTION(name) ".balign 4\n.global " #name "\n.type " #name ", %function\n" #name ":\n"
#else
#define FUNCTION(name) ".balign 4\n.global " #name "\n.thumb_func\n.type " #name ", %function\n" #name ":\n"
#endif
#define END(name) ".size " #name ", . - " #name "\n"

#if defined(__riscv)
__asm(
    ".text\n"
    /* 3 */
    FUNCTION(known_leaf) "addi a0, a0, 1\n nop\n ret\n" END(known_leaf)
    /* 1 + 2 n */
    FUNCTION(known_loop) "1: addi a0, a0, -1\n bnez a0, 1b\n ret\n" END(known_loop)
    /* 2 + leaf 3 = 5, left by a tail call */
    FUNCTION(known_tail) "nop\n j known_leaf\n" END(known_tail)
    /* 4 + leaf 3 + tail 5 = 12 */
    FUNCTION(known_nested) "mv t2, ra\n jal known_leaf\n jal known_tail\n jr t2\n" END(known_nested)
    /* 5 when the call is skipped, 8 with the leaf, which is called by address */
    FUNCTION(known_skipped_call) "mv t2, ra\n bnez a0, 1f\n.option push\n.option norelax\n call known_leaf\n"
                                 ".option pop\n jr t2\n1: nop\n nop\n jr t2\n" END(known_skipped_call));
#else
__asm(
    ".syntax unified\n.text\n.thumb\n"
    /* 3 */
    FUNCTION(known_leaf) "adds r0, #1\n nop\n bx lr\n" END(known_leaf)
    /* 1 + 2 n */
    FUNCTION(known_loop) "1: subs r0, #1\n bne 1b\n bx lr\n" END(known_loop)
    /* 2 + leaf 3 = 5, left by a tail call */
    FUNCTION(known_tail) "nop\n b known_leaf\n" END(known_tail)
    /* 4 + leaf 3 + tail 5 = 12 */
    FUNCTION(known_nested) "push {r4, lr}\n bl known_leaf\n bl known_tail\n pop {r4, pc}\n" END(known_nested)
    /* 5 when the call's condition fails, 8 with the leaf */
    FUNCTION(known_skipped_call)
#if defined(__thumb2__)
        "push {r4, lr}\n cmp r0, #0\n it eq\n bleq known_leaf\n pop {r4, pc}\n"
#else
        "push {r4, lr}\n cmp r0, #0\n bne 1f\n bl known_leaf\n pop {r4, pc}\n1: nop\n pop {r4, pc}\n"
#endif
    END(known_skipped_call));
#endif

int main(int argc, char **argv)
{
    int32_t sum = 0;
    for (int32_t i = 0; i < 10; i++) {
        sum += known_leaf(i);
        sum += known_loop(i + 1);
        sum += known_nested(i);
        sum += known_skipped_call(i & 1);
    }
    printf("sum %ld, arguments:", (long)sum);
    for (int i = 1; i < argc; i++) {
        printf(" %s", argv[i]);
    }
    printf("\n");
    if (argc > 1 && strcmp(argv[1], "fault") == 0) {
        __builtin_trap();
    }
    return argc > 1 && strcmp(argv[1], "fail") == 0 ? 7 : 0;
}
