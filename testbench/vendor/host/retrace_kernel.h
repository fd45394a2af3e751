/* Register map of the HLS kernel retrace_trace (hls/top/trace.cpp) for a host: its AXI4-Lite slave `s_axi_control`. This is the kernel that the
 * vendor's HLS compiler makes of this package, not the SystemVerilog core, whose map is another one (rtl/shell/rt_regs.h).
 *
 * The offsets follow from the order of the arguments by the vendor's rule: control words at 0x00 to 0x0c, then for every argument its value in
 * whole 32-bit words and one reserved word. The compiler prints the same in xretrace_trace_hw.h; vitis_hls.tcl compares the two after csynth and
 * stops if they differ.
 *
 * A run: write the addresses and counts, write START to CTRL, wait for DONE (or for the interrupt), read the summary in memory. */
#ifndef RETRACE_KERNEL_H
#define RETRACE_KERNEL_H

#define RETRACE_KERNEL_CTRL 0x00
#define RETRACE_KERNEL_CTRL_START 0x01    /* write 1; reads 1 until the kernel has taken it */
#define RETRACE_KERNEL_CTRL_DONE 0x02     /* cleared by reading, or by CONTINUE (flow vitis) */
#define RETRACE_KERNEL_CTRL_IDLE 0x04
#define RETRACE_KERNEL_CTRL_READY 0x08
#define RETRACE_KERNEL_CTRL_CONTINUE 0x10 /* only in a .xo: block protocol ap_ctrl_chain */
#define RETRACE_KERNEL_CTRL_RESTART 0x80
#define RETRACE_KERNEL_GIE 0x04           /* bit 0: interrupt output enabled */
#define RETRACE_KERNEL_IER 0x08           /* bit 0: done, bit 1: ready */
#define RETRACE_KERNEL_ISR 0x0c           /* the same bits; write 1 to toggle */

/* Addresses in the memory that the kernel's AXI masters see, low word first, high word at + 4. The first four point at the same image. */
#define RETRACE_KERNEL_PAIRS 0x10
#define RETRACE_KERNEL_LEAVES 0x1c
#define RETRACE_KERNEL_LIST 0x28
#define RETRACE_KERNEL_TRIANGLES 0x34
#define RETRACE_KERNEL_RAYS 0x40
#define RETRACE_KERNEL_HITS 0x4c
#define RETRACE_KERNEL_WORK 0x58
#define RETRACE_KERNEL_SUMMARY 0x64
#define RETRACE_KERNEL_IMAGE_LINES 0x70   /* size of the image in 64-byte lines */
#define RETRACE_KERNEL_RAY_COUNT 0x78
#define RETRACE_KERNEL_OPTIONS 0x80       /* 8 bits, RETRACE_KERNEL_OPTION_* */

#define RETRACE_KERNEL_OPTION_PARENT_LINKS 0x01
#define RETRACE_KERNEL_OPTION_MAILBOX 0x02
#define RETRACE_KERNEL_OPTION_WORK 0x04

/* Bytes of a record; their fields: contract_records.hpp. */
#define RETRACE_KERNEL_RAY_BYTES 32
#define RETRACE_KERNEL_HIT_BYTES 16
#define RETRACE_KERNEL_WORK_BYTES 16

/* 64-bit words of the summary. */
#define RETRACE_KERNEL_SUMMARY_STATUS 0   /* 0, or RETRACE_KERNEL_FAULT_* : nothing was traced */
#define RETRACE_KERNEL_SUMMARY_RAYS 1
#define RETRACE_KERNEL_SUMMARY_FAULTS 2   /* rays that ended in an error status */
#define RETRACE_KERNEL_SUMMARY_DOWN 3
#define RETRACE_KERNEL_SUMMARY_UP 4
#define RETRACE_KERNEL_SUMMARY_LEAF 5
#define RETRACE_KERNEL_SUMMARY_TESTS 6
#define RETRACE_KERNEL_SUMMARY_SKIPPED 7
#define RETRACE_KERNEL_SUMMARY_STEPS 8
#define RETRACE_KERNEL_SUMMARY_WORDS 9

#define RETRACE_KERNEL_FAULT_HEADER 1     /* magic or version of the image */
#define RETRACE_KERNEL_FAULT_LAYOUT 2     /* a section lies outside the image */

#endif
