// A plugin of QEMU's user-mode emulators: how many instructions of the emulated processor some functions take, with all
// that they call. instructions.py --aarch64 builds it and reads what it prints.
//
//   qemu-aarch64 -plugin libcount.so,code=HEX,function=HEX,function=HEX... -d plugin PROGRAM
//
// Addresses are those of the program's file; `code`: of its first segment that is executed. Prints a line for each
// function: its number, calls, instructions; then "all" and those of the whole program. A function that another one
// jumps to, rather than calls, cannot be followed.
//
// The interface is that of qemu-plugin.h, version 1, which Debian does not package.
#include <inttypes.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPORTED __attribute__((visibility("default")))

typedef uint64_t PluginId;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
void qemu_plugin_register_vcpu_tb_trans_cb(PluginId, void (*)(PluginId, struct qemu_plugin_tb*));
void qemu_plugin_register_vcpu_tb_exec_cb(struct qemu_plugin_tb*, void (*)(unsigned, void*), int flags, void* data);
void qemu_plugin_register_atexit_cb(PluginId, void (*)(PluginId, void*), void* data);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb*);
uint64_t qemu_plugin_tb_vaddr(const struct qemu_plugin_tb*);
uint64_t qemu_plugin_start_code(void);
void qemu_plugin_outs(const char*);

EXPORTED int qemu_plugin_version = 1;

enum { kMaxFunctions = 256, kMaxDepth = 256, kInstruction = 4 };  // bytes of one, on 64-bit Arm

struct Function {
  uint64_t address;
  uint64_t calls, instructions;
  int active;  // calls that have not returned
};
struct Block {
  uint64_t begin, end, instructions;
  struct Function* function;  // that begins here
};
struct Call {
  struct Function* function;
  uint64_t returns_to, before;
};

static struct Function functions[kMaxFunctions];
static size_t function_count, depth;
static struct Call stack[kMaxDepth];
static uint64_t file_code, all, last_end;

static void execute(unsigned processor, void* data) {
  (void)processor;  // programs of one thread
  const struct Block* const block = data;
  while (depth > 0 && stack[depth - 1].returns_to == block->begin) {
    struct Call* const call = &stack[--depth];
    if (--call->function->active == 0) call->function->instructions += all - call->before;
  }
  if (block->function && depth < kMaxDepth) {
    ++block->function->calls;
    ++block->function->active;
    stack[depth++] = (struct Call){block->function, last_end, all};
  }
  all += block->instructions;
  last_end = block->end;
}

static void translate(PluginId id, struct qemu_plugin_tb* tb) {
  (void)id;
  struct Block* const block = malloc(sizeof(*block));  // for as long as the program runs
  if (!block) abort();
  block->begin = qemu_plugin_tb_vaddr(tb);
  block->instructions = qemu_plugin_tb_n_insns(tb);
  block->end = block->begin + kInstruction * block->instructions;
  block->function = NULL;
  const uint64_t in_file = block->begin - qemu_plugin_start_code() + file_code;
  for (size_t i = 0; i < function_count; ++i) {
    if (functions[i].address == in_file) block->function = &functions[i];
  }
  qemu_plugin_register_vcpu_tb_exec_cb(tb, execute, 0, block);
}

static void report(PluginId id, void* data) {
  (void)id;
  (void)data;
  char line[100];
  for (size_t i = 0; i < function_count; ++i) {
    snprintf(line, sizeof(line), "%zu %" PRIu64 " %" PRIu64 "\n", i, functions[i].calls, functions[i].instructions);
    qemu_plugin_outs(line);
  }
  snprintf(line, sizeof(line), "all %" PRIu64 " unfinished %zu\n", all, depth);
  qemu_plugin_outs(line);
}

EXPORTED int qemu_plugin_install(PluginId id, const void* info, int count, char** arguments) {
  (void)info;
  for (int i = 0; i < count; ++i) {
    char* const value = strchr(arguments[i], '=');
    if (!value) return -1;
    const uint64_t address = strtoull(value + 1, NULL, 16);
    if (strncmp(arguments[i], "code=", 5) == 0) {
      file_code = address;
    } else if (strncmp(arguments[i], "function=", 9) == 0 && function_count < kMaxFunctions) {
      functions[function_count++].address = address;
    } else {
      return -1;
    }
  }
  qemu_plugin_register_vcpu_tb_trans_cb(id, translate);
  qemu_plugin_register_atexit_cb(id, report, NULL);
  return 0;
}
