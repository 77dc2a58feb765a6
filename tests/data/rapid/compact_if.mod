MODULE CompactIf
  PROC main()
    IF x=1 GOTO done;
    IF di1=1 rDress;
    IF a AND NOT b RETURN;
    IF ready{1}.state<>ok MoveL p1,v100,z10,tGun;
    IF (a=1)
      RAISE ERR_A;
    IF (a=1)
      b:=2;
    IF a=1 THEN b:=2; ENDIF
    IF a=1 %"r"+n%;
  ENDPROC
ENDMODULE
