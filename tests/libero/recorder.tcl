# SPDX-License-Identifier: MIT
# Runs a script of Libero's commands, does none of them, and writes down each: one line, its words in hexadecimal.
#   tclsh recorder.tcl OUT SCRIPT COMMAND...      the commands are the known ones
lassign $argv out script
set record [open $out w]

proc written {name words} {
    global record
    set line {}
    foreach word [linsert $words 0 $name] {
        lappend line =[binary encode hex [encoding convertto utf-8 $word]]
    }
    puts $record [join $line]
    return {}
}

foreach name [lrange $argv 2 end] {
    proc $name args "written $name \$args"
}
# what stands in constraints for a set of things
foreach kind {ports pins cells nets} {
    proc get_$kind names "lmap name \$names {string cat $kind: \$name}"
}
proc unknown {name args} {
    written {unknown command} [list $name]
}

if {[catch {source $script} why]} {
    puts stderr $why
    exit 1
}
close $record
