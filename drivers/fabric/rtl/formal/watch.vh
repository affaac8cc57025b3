// SPDX-License-Identifier: MIT
// What the watch over the program promises, for any words, any carrier, any current loop.
reg f_ran = 1'b0;
always @(posedge clk) f_ran <= 1'b1;
always @* if (!f_ran) assume (!rst_n);
// gate.vh proves these: what is live is armed, and the bus makes one write at a time
always @* assume (!live || armed);
reg f_starts = 1'b0, f_armed = 1'b0;
always @(posedge clk) begin
    f_starts <= starts;
    f_armed  <= armed;
end
always @* if (f_starts && !f_armed) assume (!armed);

wire        f_on     = started && armed && !tripped;
wire [31:0] f_slow   = {24'h5A17C3, number};    // the words as the page has them
wire [31:0] f_thread = {24'hA5E83C, number};
wire        f_begins = proves && !thread && wdata == f_slow;

// clocks since the program is watched, or since a round began; 2^21 - 1: that many or more
reg [20:0] f_age;
always @(posedge clk)
    if (!rst_n || !f_on || f_begins)
        f_age <= 21'd0;
    else if (f_age != 21'h1FFFFF)
        f_age <= f_age + 21'd1;

always @* if (f_ran) begin
    // a round that begins later than CLOCKS is missed; one in time is not
    if (f_on && f_age > {1'b0, clocks}) assert (missed != 2'd0);
    if (f_age <= {1'b0, clocks} && !proves) assert (missed == 2'd0);
    if (f_on) assert (left == (f_age > {1'b0, clocks} ? 21'h1FFFFF : {1'b0, clocks} - f_age));
    // any word but the next is missed, by the one whose turn it is
    if (f_on && proves && wdata != (thread ? f_thread : f_slow)) assert (missed == (thread ? 2'b10 : 2'b01));
    assert (missed != 2'b11 && (missed & (thread ? 2'b01 : 2'b10)) == 2'd0);
    // off, or not started, it says nothing
    if (!started || !armed || tripped) assert (missed == 2'd0);
    if (!started || !live) assert (!loop_late);
    if (!started) assert (clocks == 20'd0);
end

// turns: only the word of the one whose turn it is moves it on, and none is right twice running
reg [31:0] f_last;
reg        f_had;
always @(posedge clk)
    if (!rst_n)
        f_had <= 1'b0;
    else if (accepted) begin
        f_had  <= 1'b1;
        f_last <= wdata;
    end
always @* if (f_ran && f_had) assert (f_last == (thread ? f_slow : {24'hA5E83C, number - 8'd1}));
always @* if (f_ran && f_had && proves && wdata == f_last) assert (!accepted);
always @(posedge clk) if (f_ran && $past(rst_n)) begin
    if (thread != $past(thread)) assert ($past(proves && wdata == (thread ? f_thread : f_slow)));
    if ($past(thread) && !thread) assert (number == $past(number) + 8'd1);
    else assert (number == $past(number));
    // started once, with the time of that write, until a reset
    if ($past(started)) assert (started && clocks == $past(clocks));
    else assert (started == $past(starts && !armed) && clocks == ($past(starts && !armed) ? $past(wdata[19:0]) : 20'd0));
end

// the current loop: late exactly at the end of a whole period, on from before it, without a set of compares
reg f_whole, f_set;
always @(posedge clk)
    if (!rst_n || !live) begin
        f_whole <= 1'b0;
        f_set   <= 1'b0;
    end else begin
        f_whole <= f_whole || valley;
        f_set   <= commit || (f_set && !valley);
    end
always @* if (f_ran) assert (loop_late == (started && live && valley && f_whole && !f_set));
always @* if (f_ran) assert (answered == (f_set || !f_whole || !started));
