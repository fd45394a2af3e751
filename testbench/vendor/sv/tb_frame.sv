// SPDX-License-Identifier: Apache-2.0
// A frame through rt_axi in any simulator: the vector file in, every byte of every hit compared.
//
// Purpose     Shows that the core works where the project's own co-simulation does not run (a vendor's simulator, FuseSoC).
// Vectors     +frame=FILE (default frame.hex), written by frame_vectors: image, rays and the kernel's hits as 64-bit words.
// Memory      In order, with pauses from a shift register (+seed=N): address and data channels hold off at random.
// Bufferable  With +bufferable the writes reach the memory with AWCACHE[0] = 1, as if the core said so: the bench has to refuse them.
// End         Prints "tb_frame: N hits equal" and finishes, or $fatal with the first difference, a fault status, or no end in time.
`timescale 1ns / 1ps
module tb_frame;
  localparam int unsigned Words = 1 << 17;
  localparam int unsigned HeadWords = 8;
  localparam int unsigned MostClocks = 2_000_000;
  localparam logic [63:0] Unwritten = 64'h5a5a5a5a5a5a5a5a;

  logic clk = 1'b0;
  logic rst_n = 1'b0;
  always #5 clk = !clk;

  logic [63:0] file_mem[Words];  // as read
  logic [63:0] memory[Words];    // what the core sees: the file, and hits behind it
  int unsigned image_words, rays, ray_word, expected_word, hit_word;

  // ---------------------------------------------------------------------------------------------- the core
  logic interrupt;
  logic aw_valid, aw_ready, w_valid, w_ready, b_valid, ar_valid, ar_ready, r_valid;
  logic [8:0] lite_addr;
  logic [31:0] lite_wdata, lite_rdata;
  logic m_ar_valid, m_ar_ready, m_r_valid, m_r_ready, m_r_last, m_aw_valid, m_aw_ready, m_w_valid, m_w_ready, m_w_last, m_b_valid, m_b_ready;
  logic [6:0] m_ar_id, m_r_id, m_aw_id, m_b_id;
  logic [39:0] m_ar_addr, m_aw_addr;
  logic [7:0] m_ar_len, m_aw_len;
  logic [3:0] m_aw_cache, aw_cache;
  logic bufferable;
  initial bufferable = $test$plusargs("bufferable") != 0;
  assign aw_cache = m_aw_cache | {3'b000, bufferable};
  logic [63:0] m_r_data, m_w_data;
  logic [7:0] m_w_strb;

  rt_axi u_axi (
      .aclk(clk),
      .aresetn(rst_n),
      .interrupt(interrupt),
      .s_axi_control_awvalid(aw_valid),
      .s_axi_control_awready(aw_ready),
      .s_axi_control_awaddr(lite_addr),
      .s_axi_control_awprot(3'b000),
      .s_axi_control_wvalid(w_valid),
      .s_axi_control_wready(w_ready),
      .s_axi_control_wdata(lite_wdata),
      .s_axi_control_wstrb(4'hf),
      .s_axi_control_bvalid(b_valid),
      .s_axi_control_bready(1'b1),
      .s_axi_control_bresp(),
      .s_axi_control_arvalid(ar_valid),
      .s_axi_control_arready(ar_ready),
      .s_axi_control_araddr(lite_addr),
      .s_axi_control_arprot(3'b000),
      .s_axi_control_rvalid(r_valid),
      .s_axi_control_rready(1'b1),
      .s_axi_control_rdata(lite_rdata),
      .s_axi_control_rresp(),
      .m_axi_image_arvalid(m_ar_valid),
      .m_axi_image_arready(m_ar_ready),
      .m_axi_image_arid(m_ar_id),
      .m_axi_image_araddr(m_ar_addr),
      .m_axi_image_arlen(m_ar_len),
      .m_axi_image_arsize(),
      .m_axi_image_arburst(),
      .m_axi_image_arcache(),
      .m_axi_image_arprot(),
      .m_axi_image_rvalid(m_r_valid),
      .m_axi_image_rready(m_r_ready),
      .m_axi_image_rid(m_r_id),
      .m_axi_image_rdata(m_r_data),
      .m_axi_image_rresp(2'b00),
      .m_axi_image_rlast(m_r_last),
      .m_axi_image_awvalid(m_aw_valid),
      .m_axi_image_awready(m_aw_ready),
      .m_axi_image_awid(m_aw_id),
      .m_axi_image_awaddr(m_aw_addr),
      .m_axi_image_awlen(m_aw_len),
      .m_axi_image_awsize(),
      .m_axi_image_awburst(),
      .m_axi_image_awcache(m_aw_cache),
      .m_axi_image_awprot(),
      .m_axi_image_wvalid(m_w_valid),
      .m_axi_image_wready(m_w_ready),
      .m_axi_image_wdata(m_w_data),
      .m_axi_image_wstrb(m_w_strb),
      .m_axi_image_wlast(m_w_last),
      .m_axi_image_bvalid(m_b_valid),
      .m_axi_image_bready(m_b_ready),
      .m_axi_image_bid(m_b_id),
      .m_axi_image_bresp(2'b00)
  );

  // ---------------------------------------------------------------------------------------------- the memory
  logic [31:0] noise = 32'h1;
  always_ff @(posedge clk) noise <= {noise[30:0], noise[31] ^ noise[21] ^ noise[1] ^ noise[0]};

  logic reading = 1'b0;
  logic writing = 1'b0;
  logic answering = 1'b0;
  logic r_held_q = 1'b0;
  logic [36:0] read_word, write_word;
  logic [7:0] beats_left;
  assign m_ar_ready = !reading && noise[0];
  assign m_r_valid  = reading && (noise[3] || r_held_q);  // what was offered stays
  assign m_r_data   = memory[read_word[16:0]];
  assign m_r_last   = beats_left == '0;
  assign m_aw_ready = !writing && !answering && noise[5];
  assign m_w_ready  = writing && noise[7];
  assign m_b_valid  = answering;
  assign m_b_id     = m_aw_id;

  always @(posedge clk) begin
    if (!rst_n) begin
      reading   <= 1'b0;
      writing   <= 1'b0;
      answering <= 1'b0;
      r_held_q  <= 1'b0;
    end else begin
      r_held_q <= m_r_valid && !m_r_ready;
      if (m_ar_valid && m_ar_ready) begin
        reading    <= 1'b1;
        read_word  <= m_ar_addr[39:3];
        beats_left <= m_ar_len;
        m_r_id     <= m_ar_id;
        if (m_ar_addr[39:3] + 37'(m_ar_len) >= 37'(hit_word)) $fatal(1, "tb_frame: read outside image and rays: %h", m_ar_addr);
      end
      if (m_r_valid && m_r_ready) begin
        read_word  <= read_word + 1'b1;
        beats_left <= beats_left - 1'b1;
        if (m_r_last) reading <= 1'b0;
      end
      if (m_aw_valid && m_aw_ready) begin
        writing    <= 1'b1;
        write_word <= m_aw_addr[39:3];
        if (aw_cache[0]) $fatal(1, "tb_frame: a bufferable write: its answer does not say that the hit is visible");
        if (m_aw_addr[39:3] < 37'(hit_word) || m_aw_addr[39:3] + 37'(m_aw_len) >= 37'(hit_word + 2 * rays))
          $fatal(1, "tb_frame: write outside the hits: %h", m_aw_addr);
      end
      if (m_w_valid && m_w_ready) begin
        for (int i = 0; i < 8; ++i) if (m_w_strb[i]) memory[write_word[16:0]][8*i+:8] <= m_w_data[8*i+:8];
        write_word <= write_word + 1'b1;
        if (m_w_last) begin
          writing   <= 1'b0;
          answering <= 1'b1;
        end
      end
      if (m_b_valid && m_b_ready) answering <= 1'b0;
    end
  end

  // ---------------------------------------------------------------------------------------------- the host
  task automatic write_register(input logic [8:0] address, input logic [31:0] data);
    logic address_left, data_left;
    address_left = 1'b1;
    data_left = 1'b1;
    lite_addr <= address;
    lite_wdata <= data;
    aw_valid <= 1'b1;
    w_valid <= 1'b1;
    while (address_left || data_left) begin
      @(posedge clk);
      if (aw_valid && aw_ready) begin
        address_left = 1'b0;
        aw_valid <= 1'b0;
      end
      if (w_valid && w_ready) begin
        data_left = 1'b0;
        w_valid <= 1'b0;
      end
    end
    while (!b_valid) @(posedge clk);
    @(posedge clk);
  endtask

  task automatic read_register(input logic [8:0] address, output logic [31:0] data);
    lite_addr <= address;
    ar_valid  <= 1'b1;
    @(posedge clk);
    while (!ar_ready) @(posedge clk);
    ar_valid <= 1'b0;
    while (!r_valid) @(posedge clk);
    data = lite_rdata;
    @(posedge clk);
  endtask

  string frame;
  int unsigned seed;
  logic [31:0] value;

  initial begin
    aw_valid = 1'b0;
    w_valid  = 1'b0;
    ar_valid = 1'b0;
    lite_addr = '0;
    lite_wdata = '0;
    if (!$value$plusargs("frame=%s", frame)) frame = "frame.hex";
    if ($value$plusargs("seed=%d", seed)) noise = seed | 32'h1;
    for (int unsigned i = 0; i < Words; ++i) file_mem[i] = Unwritten;
    $readmemh(frame, file_mem);
    image_words = file_mem[0][31:0];
    rays = file_mem[1][31:0];
    ray_word = HeadWords + image_words;
    expected_word = ray_word + 4 * rays;
    hit_word = ray_word + 4 * rays;
    if (file_mem[0] == Unwritten || rays == 0 || image_words % 8 != 0 || expected_word + 2 * rays > Words)
      $fatal(1, "tb_frame: %s is no vector file for this bench", frame);
    for (int unsigned i = 0; i < Words; ++i) memory[i] = i < hit_word ? file_mem[i] : Unwritten;
    repeat (8) @(posedge clk);
    rst_n <= 1'b1;
    repeat (8) @(posedge clk);

    read_register(9'h000, value);
    if (value != 32'h52545243) $fatal(1, "tb_frame: no Retrace core: id %h", value);
    write_register(9'h020, 32'(8 * HeadWords));
    write_register(9'h024, '0);
    write_register(9'h028, 32'(image_words / 8));
    write_register(9'h030, 32'(8 * ray_word));
    write_register(9'h034, '0);
    write_register(9'h038, 32'(rays));
    write_register(9'h03c, '0);
    write_register(9'h040, 32'(8 * hit_word));
    write_register(9'h044, '0);
    write_register(9'h010, 32'h5);  // start, interrupt enable
    fork
      begin
        repeat (MostClocks) @(posedge clk);
        $fatal(1, "tb_frame: not done after %0d clocks", MostClocks);
      end
    join_none
    while (!interrupt) @(posedge clk);
    read_register(9'h014, value);
    if (value[31:2] != '0) $fatal(1, "tb_frame: status %h", value);
    for (int unsigned i = 0; i < 2 * rays; ++i) begin
      if (memory[hit_word+i] != file_mem[expected_word+i])
        $fatal(1, "tb_frame: hit %0d, word %0d: %h, expected %h", i / 2, i % 2, memory[hit_word+i], file_mem[expected_word+i]);
    end
    read_register(9'h100, value);
    $display("tb_frame: %0d hits equal, %0d clocks", rays, value);
    $finish;
  end
endmodule
