MODULE Blanks
　VAR　num a;　
 PROC p()　! c
　　a:=　1;
ENDPROC
ENDMODULE
