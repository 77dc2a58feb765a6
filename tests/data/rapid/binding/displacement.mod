MODULE m
  CONST robtarget p1:=[[1,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget jHome:=[[0,0,0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    before;
    PDispSet peShift;
    within;
    MoveAbsJ jHome,v100,fine,tGun;
    PDispOff;
    after;
    IF di1=1 PDispOn p1,tGun;
    maybe;
    PDispOff;
    WHILE TRUE DO
      inLoop;
      PDispSet peShift;
    ENDWHILE
  ENDPROC
  PROC before()
    MoveL p1,v100,z10,tGun\WObj:=wTable;
  ENDPROC
  PROC within()
    MoveL p1,v100,z10,tGun\WObj:=wTable;
  ENDPROC
  PROC after()
    MoveL p1,v100,z10,tGun\WObj:=wTable;
  ENDPROC
  PROC maybe()
    MoveL p1,v100,z10,tGun\WObj:=wTable;
  ENDPROC
  PROC inLoop()
    MoveL p1,v100,z10,tGun\WObj:=wTable;
  ENDPROC
  TRAP tStop
    MoveL p1,v100,z10,tGun\WObj:=wTable;
  ENDTRAP
ENDMODULE
