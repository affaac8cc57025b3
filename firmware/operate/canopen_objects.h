/* SPDX-License-Identifier: MIT */
/*
 * The communication objects of CiA 301: the one table from which firmware and EDS take them. The drive's objects are in
 * objects.h; its parameters are at 0x3000, its reactions to faults at 0x2400, in order. The second axis has its own, and those
 * of CiA 402 (0x6000...), 0x800 higher, as CiA 402 defines it.
 *
 * Index, subindex, type, access, name, default as in the EDS, member of struct canopen; for CONST the value. Of PDOs the first
 * of four; the others follow in steps of one index and one struct canopen_pdo.
 */
#ifndef FIRMWARE_OPERATE_CANOPEN_OBJECTS_H
#define FIRMWARE_OPERATE_CANOPEN_OBJECTS_H

#define CANOPEN_PARAMS    0x3000u
#define CANOPEN_REACTIONS 0x2400u
#define CANOPEN_AXIS      0x800u /* offset from an axis to the next */
#define CANOPEN_DEVICE    0x1000u
#define CANOPEN_TYPE      0x67FFu     /* CiA 301: device type of each of several axes, */
#define CANOPEN_SEVERAL   0xFFFF0192u /* and of 0x1000 with several axes */

/* clang-format off */
#define CANOPEN_OBJECTS(X) \
    X(0x1001, 0, U8,  RO,    "Error register", 0, error_register) \
    X(0x1003, 0, U8,  RW,    "Number of errors", 0, errors) \
    X(0x1003, 1, U32, RO,    "Newest error", 0, error[0]) \
    X(0x1003, 2, U32, RO,    "Error before", 0, error[1]) \
    X(0x1003, 3, U32, RO,    "Third error", 0, error[2]) \
    X(0x1003, 4, U32, RO,    "Fourth error", 0, error[3]) \
    X(0x1005, 0, U32, RW,    "COB-ID SYNC", 0x80, sync_id) \
    X(0x1010, 0, U8,  CONST, "Store parameters: number", 1, 1) \
    X(0x1011, 0, U8,  CONST, "Restore parameters: number", 1, 1) \
    X(0x1014, 0, U32, RW,    "COB-ID EMCY", $NODEID+0x80, emergency_id) \
    X(0x1015, 0, U16, RW,    "Inhibit time EMCY", 0, emergency_inhibit) \
    X(0x1016, 0, U8,  CONST, "Consumer heartbeat time: number", 1, 1) \
    X(0x1016, 1, U32, RW,    "Consumer heartbeat time", 0, consumer) \
    X(0x1017, 0, U16, RW,    "Producer heartbeat time", 0, heartbeat_ms) \
    X(0x1018, 0, U8,  CONST, "Identity: number", 4, 4) \
    X(0x1022, 0, U16, CONST, "Store format", 0, 0) \
    X(0x1200, 0, U8,  CONST, "SDO server: number", 2, 2) \
    X(0x1200, 1, U32, RO,    "COB-ID client to server", $NODEID+0x600, sdo_in) \
    X(0x1200, 2, U32, RO,    "COB-ID server to client", $NODEID+0x580, sdo_out)

#define CANOPEN_RPDO(X) \
    X(0x1400, 0, U8,  CONST, "RPDO: highest subindex", 2, 2) \
    X(0x1400, 1, U32, RW,    "COB-ID", 0, rpdo[0].id) \
    X(0x1400, 2, U8,  RW,    "Transmission type", 255, rpdo[0].type) \
    X(0x1600, 0, U8,  RW,    "Mapped objects", 0, rpdo[0].count) \
    X(0x1600, 1, U32, RW,    "Mapped object 1", 0, rpdo[0].map[0]) \
    X(0x1600, 2, U32, RW,    "Mapped object 2", 0, rpdo[0].map[1]) \
    X(0x1600, 3, U32, RW,    "Mapped object 3", 0, rpdo[0].map[2]) \
    X(0x1600, 4, U32, RW,    "Mapped object 4", 0, rpdo[0].map[3]) \
    X(0x1600, 5, U32, RW,    "Mapped object 5", 0, rpdo[0].map[4]) \
    X(0x1600, 6, U32, RW,    "Mapped object 6", 0, rpdo[0].map[5]) \
    X(0x1600, 7, U32, RW,    "Mapped object 7", 0, rpdo[0].map[6]) \
    X(0x1600, 8, U32, RW,    "Mapped object 8", 0, rpdo[0].map[7])

#define CANOPEN_TPDO(X) \
    X(0x1800, 0, U8,  CONST, "TPDO: highest subindex", 5, 5) \
    X(0x1800, 1, U32, RW,    "COB-ID", 0, tpdo[0].id) \
    X(0x1800, 2, U8,  RW,    "Transmission type", 1, tpdo[0].type) \
    X(0x1800, 3, U16, RW,    "Inhibit time", 0, tpdo[0].inhibit) \
    X(0x1800, 5, U16, RW,    "Event timer", 0, tpdo[0].event_ms) \
    X(0x1A00, 0, U8,  RW,    "Mapped objects", 0, tpdo[0].count) \
    X(0x1A00, 1, U32, RW,    "Mapped object 1", 0, tpdo[0].map[0]) \
    X(0x1A00, 2, U32, RW,    "Mapped object 2", 0, tpdo[0].map[1]) \
    X(0x1A00, 3, U32, RW,    "Mapped object 3", 0, tpdo[0].map[2]) \
    X(0x1A00, 4, U32, RW,    "Mapped object 4", 0, tpdo[0].map[3]) \
    X(0x1A00, 5, U32, RW,    "Mapped object 5", 0, tpdo[0].map[4]) \
    X(0x1A00, 6, U32, RW,    "Mapped object 6", 0, tpdo[0].map[5]) \
    X(0x1A00, 7, U32, RW,    "Mapped object 7", 0, tpdo[0].map[6]) \
    X(0x1A00, 8, U32, RW,    "Mapped object 8", 0, tpdo[0].map[7])

/* Index, name, text; NULL: the data sheet, a domain. */
#define CANOPEN_STRINGS(X) \
    X(0x1008, "Manufacturer device name", "mssfoc") \
    X(0x1009, "Manufacturer hardware version", "SmartFusion2") \
    X(0x100A, "Manufacturer software version", CONFIG_VERSION) \
    X(0x1021, "Store EDS", NULL)

/*
 * Defaults of each PDO: identifier without the node number, bits 30 (no RTR) and 31 (invalid), type, event timer in ms, mapped
 * objects; RPDO 1 to 4, TPDO 1 to 4. Status word and mode are sent on change and every 100 ms, because python-canopen's
 * BaseNode402 reads them from PDOs only, and misses the first. RPDO 2 has only the mode: with a control word next to it, as in
 * CiA 402, a change of mode by BaseNode402 would send a control word that it has never set, 0.
 */
#define CANOPEN_PDOS(X) \
    X(rpdo, 0, 0x200, 0, 255, 0, 1, 0x60400010, 0) \
    X(rpdo, 1, 0x300, 0, 255, 0, 1, 0x60600008, 0) \
    X(rpdo, 2, 0x400, 0, 255, 0, 2, 0x60400010, 0x607A0020) \
    X(rpdo, 3, 0x500, 2, 255, 0, 2, 0x60400010, 0x60FF0020) \
    X(tpdo, 0, 0x180, 1, 255, 100, 1, 0x60410010, 0) \
    X(tpdo, 1, 0x280, 1, 255, 100, 2, 0x60410010, 0x60610008) \
    X(tpdo, 2, 0x380, 1, 1, 0, 2, 0x60410010, 0x60640020) \
    X(tpdo, 3, 0x480, 3, 1, 0, 2, 0x60410010, 0x606C0020)
/* clang-format on */

#endif
