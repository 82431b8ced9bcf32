/* libLLVM as Dr.Jit is given it in tests: the same, but without any optimisation.

   Found before the real functions, as this library is the one that Dr.Jit opens. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <stddef.h>

/* No passes; NULL is success. */
void *LLVMRunPasses(void *module, const char *passes, void *machine, void *options) { return NULL; }

void *LLVMCreateTargetMachine(void *target, const char *triple, const char *processor,
                              const char *features, int level, int relocation, int code_model) {
    void *(*create)(void *, const char *, const char *, const char *, int, int, int);
    create = dlsym(RTLD_NEXT, "LLVMCreateTargetMachine");
    return create(target, triple, processor, features, 0, relocation, code_model);
}
