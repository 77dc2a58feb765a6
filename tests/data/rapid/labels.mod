MODULE Labels
  PROC start()
    start:
    IF x<3 GOTO start;
    next: y:=1;
    TEST y
    CASE 1:
      inner:
      GOTO inner;
    DEFAULT:
    ENDTEST
  ENDPROC
ENDMODULE
