// Names the first algorithm that an installed CONSAC can learn with, by the C interface.
#include <consac.h>
#include <stdio.h>

int main(void) {
  printf("the C interface has %s\n", consac_algorithm(0));
  return consac_abi_version() == CONSAC_ABI_VERSION ? 0 : 1;
}
