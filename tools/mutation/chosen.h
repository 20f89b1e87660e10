/* Included by the sources that tools/mutate has changed: which of the mutants in them is alive. */
#ifndef PM_MUTATION_CHOSEN_H
#define PM_MUTATION_CHOSEN_H

#ifdef __cplusplus
extern "C" {
#endif
extern int pm_mutant_alive; /* -1: none, and what is reached is recorded */
int pm_mutant_reach(int number);
#ifdef __cplusplus
}
#endif

#define PM_MUTANT(number)                                                                                    \
    (pm_mutant_alive == (number) || (__builtin_expect(pm_mutant_alive < 0, 0) && pm_mutant_reach(number)))

#endif
