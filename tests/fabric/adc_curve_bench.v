// SPDX-License-Identifier: MIT
// Prints what the sensor's curve gives for each code, from 0 to 4095.
module bench;
    reg clk = 0, rst_n = 0;
    always #5 clk = !clk;

    reg  [11:0] code = 0;
    wire [11:0] temp;
    adc_curve dut (.clk(clk), .rst_n(rst_n), .code(code), .temp(temp));

    integer n;
    initial begin
        @(negedge clk) rst_n = 1;
        for (n = 0; n < 4096; n = n + 1) begin
            code = n;
            repeat (3) @(negedge clk);
            $display("%0d", temp);
        end
        $finish;
    end
endmodule
