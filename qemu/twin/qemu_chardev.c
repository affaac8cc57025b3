/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Characters: typing into the guest's serial lines, and a line of the twin's own. */
#include "qemu_api.h"
#include "qemu_symbols.h"

struct vm_chardev *vm_find_chardev(const char *id)
{
    return vm.qemu_chr_find(id);
}

bool vm_type(struct vm_chardev *chardev, uint8_t byte)
{
    if (vm.qemu_chr_be_can_write(chardev) < 1) {
        return false;
    }
    vm.qemu_chr_be_write(chardev, &byte, 1);
    return true;
}

struct vm_chardev *vm_chardev_open(const char *id, int (*may_hear)(void *), void (*hear)(void *, const uint8_t *, int),
                                   void (*changes)(void *, int))
{
    opaque *chardev = vm.qemu_chr_find(id);
    opaque *frontend = vm_room(OPAQUE_BYTES);
    if (!chardev || !vm.qemu_chr_fe_init(frontend, chardev, NULL)) {
        return NULL;
    }
    vm.qemu_chr_fe_set_handlers(frontend, may_hear, hear, changes, NULL, NULL, NULL, true);
    return frontend;
}

void vm_chardev_send(struct vm_chardev *opened, const void *bytes, size_t count)
{
    (void)vm.qemu_chr_fe_write(opened, bytes, (int)count);
}
